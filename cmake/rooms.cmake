# The rooms as library targets, linked as cmake/rooms.txt says.

set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/rooms.txt)
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/rooms.txt tellurion_room_lines REGEX "^[a-z]+:")

set(TELLURION_ROOMS "")  # every library room, lowest first
foreach(line IN LISTS tellurion_room_lines)
  string(REGEX MATCH "^([a-z]+): *(.*)$" _ "${line}")
  set(room ${CMAKE_MATCH_1})
  string(REPLACE " " ";" uses "${CMAKE_MATCH_2}")
  if(NOT room MATCHES "^(apps|bench)$")
    list(APPEND TELLURION_ROOMS ${room})
    if(NOT room STREQUAL "base")
      list(APPEND uses base)
    endif()
  endif()
  set(TELLURION_USES_${room} ${uses})
endforeach()

# tellurion_add_room(<room> [extra sources...]): the library tellurion_<room> of src/<room>/ (header-only while the
# folder holds no .cpp).
function(tellurion_add_room room)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${room}/*.cpp)
  list(APPEND sources ${ARGN})
  if(room STREQUAL "source" AND NOT TELLURION_GDAL)
    list(FILTER sources EXCLUDE REGEX "/src/source/(gdal|proj)/")
  endif()
  if(room STREQUAL "prepare" AND NOT TELLURION_GDAL)
    list(FILTER sources EXCLUDE REGEX "/src/prepare/gdal/")
  endif()
  if(sources)
    set(visibility PUBLIC)
    add_library(tellurion_${room} STATIC ${sources})
    tellurion_use_warnings(tellurion_${room})
  else()
    set(visibility INTERFACE)
    add_library(tellurion_${room} INTERFACE)
  endif()
  add_library(tellurion::${room} ALIAS tellurion_${room})
  set_target_properties(tellurion_${room} PROPERTIES EXPORT_NAME ${room})
  target_compile_features(tellurion_${room} ${visibility} cxx_std_20)
  target_include_directories(tellurion_${room} ${visibility}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/tellurion>)
  foreach(used IN LISTS TELLURION_USES_${room})
    target_link_libraries(tellurion_${room} ${visibility} tellurion::${used})
  endforeach()
endfunction()

# tellurion_room_links(<room> libraries...): third-party libraries that the room uses inside its own .cpp files.
function(tellurion_room_links room)
  get_target_property(type tellurion_${room} TYPE)
  if(NOT type STREQUAL "INTERFACE_LIBRARY")
    target_link_libraries(tellurion_${room} PRIVATE ${ARGN})
  endif()
endfunction()
