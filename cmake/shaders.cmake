# Every file of shaders/ becomes part of the library; sets TELLURION_EMBEDDED_SHADERS to the generated source.

file(GLOB_RECURSE shader_files CONFIGURE_DEPENDS
  ${PROJECT_SOURCE_DIR}/shaders/*.vert ${PROJECT_SOURCE_DIR}/shaders/*.frag ${PROJECT_SOURCE_DIR}/shaders/*.glsl)
list(SORT shader_files)
set(shader_names "")
foreach(file IN LISTS shader_files)
  cmake_path(RELATIVE_PATH file BASE_DIRECTORY ${PROJECT_SOURCE_DIR}/shaders OUTPUT_VARIABLE name)
  string(APPEND shader_names "${name}\n")
endforeach()
set(shader_list ${PROJECT_BINARY_DIR}/generated/shaders.txt)
file(CONFIGURE OUTPUT ${shader_list} CONTENT "${shader_names}" @ONLY)

set(TELLURION_EMBEDDED_SHADERS ${PROJECT_BINARY_DIR}/generated/embedded_shaders.cpp)
add_custom_command(
  OUTPUT ${TELLURION_EMBEDDED_SHADERS}
  COMMAND ${CMAKE_COMMAND} -DDIRECTORY=${PROJECT_SOURCE_DIR}/shaders -DLIST_FILE=${shader_list}
    -DOUTPUT=${TELLURION_EMBEDDED_SHADERS} -P ${PROJECT_SOURCE_DIR}/cmake/embed_shaders.cmake
  DEPENDS ${shader_files} ${shader_list} ${PROJECT_SOURCE_DIR}/cmake/embed_shaders.cmake
  COMMENT "Embedding shaders"
  VERBATIM)
