# The installed package: program, libraries, headers, default world, and what find_package(Tellurion) reads.

include(CMakePackageConfigHelpers)

if(TARGET tellurion)
  install(TARGETS tellurion RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
list(TRANSFORM TELLURION_ROOMS PREPEND tellurion_ OUTPUT_VARIABLE room_targets)
install(TARGETS ${room_targets} EXPORT TellurionTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tellurion FILES_MATCHING PATTERN "*.h")
install(DIRECTORY data/earth DESTINATION ${TELLURION_INSTALL_DATA} OPTIONAL)
install(FILES LICENSE NOTICE DESTINATION ${CMAKE_INSTALL_DOCDIR})

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Tellurion)
install(EXPORT TellurionTargets NAMESPACE tellurion:: DESTINATION ${package_folder})
configure_package_config_file(cmake/TellurionConfig.cmake.in ${PROJECT_BINARY_DIR}/TellurionConfig.cmake
  INSTALL_DESTINATION ${package_folder} PATH_VARS TELLURION_INSTALL_DATA)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/TellurionConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/TellurionConfig.cmake
  ${PROJECT_BINARY_DIR}/TellurionConfigVersion.cmake
  cmake/TellurionDependencies.cmake
  DESTINATION ${package_folder})
