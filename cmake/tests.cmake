# All tests, registered with ctest. Labels: quick, slow or long (each test has one of them), gl (needs an OpenGL context, which
# Mesa gives without a GPU or display), e2e, compile_fail, architecture, fuzz.

find_package(doctest REQUIRED)
list(APPEND CMAKE_MODULE_PATH /usr/share/cmake/geographiclib)
find_package(GeographicLib REQUIRED)
find_package(Python3 COMPONENTS Interpreter)
if(EXISTS /usr/bin/python3)
  set(TELLURION_PYTHON /usr/bin/python3)  # the one that Debian's numpy and GDAL packages belong to
else()
  set(TELLURION_PYTHON ${Python3_EXECUTABLE})
endif()

set(TELLURION_SHARED_DATA_DIR ${PROJECT_SOURCE_DIR}/../shared/data CACHE PATH
  "Larger test data that are no part of the project; tests that need them skip themselves where they are missing")
cmake_path(ABSOLUTE_PATH TELLURION_SHARED_DATA_DIR BASE_DIRECTORY ${PROJECT_SOURCE_DIR} NORMALIZE
  OUTPUT_VARIABLE shared_data)

set(TELLURION_SLOW_TESTS "" CACHE STRING "Unit test executables that are labelled slow instead of quick")

# --- Unit tests: tests/<room>/*_test.cpp -> test_<room>, tests/<room>/*_gl_test.cpp -> test_<room>_gl -------------------

# The same main, once plain, once for programs that load an OpenGL driver.
foreach(main test_main test_main_gl)
  add_library(${main} OBJECT ${PROJECT_SOURCE_DIR}/tests/test_main.cpp)
  tellurion_use_warnings(${main})
  target_link_libraries(${main} PRIVATE doctest::doctest)
endforeach()
if(TELLURION_SANITIZE MATCHES "address")
  target_compile_definitions(test_main_gl PRIVATE
    TELLURION_KEEP_LOADED="/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/dri/swrast_dri.so")
endif()

# tellurion_add_test(<name> <room> <main> sources...): links the room with all that it uses, and the rooms named in
# tests/<room>/rooms.txt (separated by spaces or lines) if that file exists.
function(tellurion_add_test name room main)
  add_executable(${name} ${ARGN} $<TARGET_OBJECTS:${main}>)
  tellurion_use_warnings(${name})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(${name} PRIVATE
    TELLURION_SHARED_DATA_DIR="${shared_data}"
    TELLURION_TEST_DATA_DIR="${PROJECT_SOURCE_DIR}/tests/data"
    TELLURION_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_link_libraries(${name} PRIVATE tellurion::${room} doctest::doctest ${CMAKE_DL_LIBS}
    ${GeographicLib_LIBRARIES} PkgConfig::EPOXY nlohmann_json::nlohmann_json)
  target_include_directories(${name} SYSTEM PRIVATE ${GeographicLib_INCLUDE_DIRS})
  if(TELLURION_GDAL)
    target_link_libraries(${name} PRIVATE GDAL::GDAL PROJ::proj)
  endif()
  set(rooms_file ${PROJECT_SOURCE_DIR}/tests/${room}/rooms.txt)
  if(EXISTS ${rooms_file})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${rooms_file})
    file(READ ${rooms_file} more)
    string(REGEX MATCHALL "[a-z]+" more "${more}")
    list(TRANSFORM more PREPEND tellurion::)
    target_link_libraries(${name} PRIVATE ${more})
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  if(name IN_LIST TELLURION_SLOW_TESTS)
    set(labels slow)
  else()
    set(labels quick)
  endif()
  if(main STREQUAL "test_main_gl")
    list(APPEND labels gl)
  endif()
  set(timeout 600)
  if(TELLURION_SANITIZE)
    set(timeout 3000)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${labels}" TIMEOUT ${timeout})
endfunction()

foreach(room IN LISTS TELLURION_ROOMS)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${room}/*_test.cpp)
  set(gl_sources ${sources})
  list(FILTER gl_sources INCLUDE REGEX "_gl_test\\.cpp$")
  list(FILTER sources EXCLUDE REGEX "_gl_test\\.cpp$")
  if(sources)
    tellurion_add_test(test_${room} ${room} test_main ${sources})
  endif()
  if(gl_sources)
    tellurion_add_test(test_${room}_gl ${room} test_main_gl ${gl_sources})
  endif()
endforeach()

# --- Scripts against the program: tests/e2e/*.{py,sh} -> e2e_<name>, tests/golden/*.{py,sh} -> golden_<name> -----------
# Files whose names begin with _ are helpers. Among a script's first five lines `# label: slow` and `# timeout: N` count.
# Exit status 77 means skipped. The longest time-outs start first.

set(script_environment "TELLURION=$<TARGET_FILE:tellurion>" "TELLURION_SHARED_DATA_DIR=${shared_data}"
  "TELLURION_TEST_DATA_DIR=${PROJECT_SOURCE_DIR}/tests/data" PYTHONDONTWRITEBYTECODE=1)
if(TELLURION_SANITIZE MATCHES "address")
  list(APPEND script_environment ASAN_OPTIONS=detect_leaks=0)  # the program does not keep the OpenGL driver loaded
endif()
if(TARGET tellurion)
  foreach(kind e2e golden)
    file(GLOB scripts CONFIGURE_DEPENDS
      ${PROJECT_SOURCE_DIR}/tests/${kind}/*.py ${PROJECT_SOURCE_DIR}/tests/${kind}/*.sh)
    foreach(script IN LISTS scripts)
      cmake_path(GET script STEM LAST_ONLY stem)
      if(stem MATCHES "^_")
        continue()
      endif()
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${script})
      file(STRINGS ${script} head LIMIT_COUNT 5)
      set(labels quick)
      set(timeout 300)
      foreach(line IN LISTS head)
        if(line MATCHES "^# label: *([a-z]+)")
          set(labels ${CMAKE_MATCH_1})
        elseif(line MATCHES "^# timeout: *([0-9]+)")
          set(timeout ${CMAKE_MATCH_1})
        endif()
      endforeach()
      if(script MATCHES "\\.py$")
        set(command ${TELLURION_PYTHON} ${script})
      else()
        set(command bash ${script})
      endif()
      add_test(NAME ${kind}_${stem} COMMAND ${command} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
      set_tests_properties(${kind}_${stem} PROPERTIES
        LABELS "${labels};${kind}" TIMEOUT ${timeout} COST ${timeout} SKIP_RETURN_CODE 77
        ENVIRONMENT "${script_environment}")
    endforeach()
  endforeach()
endif()

# --- What must not compile: tests/compile_fail/<name>.cpp compiles as it is, and not with -DMISUSE ---------------------

file(GLOB misuse_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/compile_fail/*.cpp)
foreach(source IN LISTS misuse_sources)
  cmake_path(GET source STEM name)
  set(command ${CMAKE_CXX_COMPILER} -std=c++20 -Wall -Wextra -Werror -fsyntax-only -I${PROJECT_SOURCE_DIR}/src)
  add_test(NAME compile_fail_${name}_right COMMAND ${command} ${source})
  add_test(NAME compile_fail_${name}_misuse COMMAND ${command} -DMISUSE ${source})
  set_tests_properties(compile_fail_${name}_misuse PROPERTIES PASS_REGULAR_EXPRESSION "error: ")
  set_tests_properties(compile_fail_${name}_right compile_fail_${name}_misuse PROPERTIES
    LABELS "quick;compile_fail" TIMEOUT 120)
endforeach()

# --- Architecture ----------------------------------------------------------------------------------------------------

set(check_includes ${TELLURION_PYTHON} -B ${PROJECT_SOURCE_DIR}/tests/architecture/check_includes.py)
add_test(NAME architecture_includes COMMAND ${check_includes} ${PROJECT_SOURCE_DIR})
add_test(NAME architecture_includes_self_test COMMAND ${check_includes} --self-test)
set(check_names ${TELLURION_PYTHON} -B ${PROJECT_SOURCE_DIR}/tests/architecture/check_names.py)
add_test(NAME architecture_names COMMAND ${check_names} ${PROJECT_SOURCE_DIR})
add_test(NAME architecture_names_self_test COMMAND ${check_names} --self-test)
set_tests_properties(architecture_includes architecture_includes_self_test architecture_names architecture_names_self_test PROPERTIES
  LABELS "quick;architecture" TIMEOUT 60)

# Every header compiles alone: a source file for each, built on demand (and cached) by the test.
file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/*.h)
set(header_sources "")
foreach(header IN LISTS headers)
  if(header MATCHES "/src/(source|prepare)/(gdal|proj)/" AND NOT TELLURION_GDAL)
    continue()
  endif()
  cmake_path(RELATIVE_PATH header BASE_DIRECTORY ${PROJECT_SOURCE_DIR}/src OUTPUT_VARIABLE name)
  string(REGEX REPLACE "\\.h$" ".cpp" source ${PROJECT_BINARY_DIR}/generated/headers/${name})
  file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${name}\"\n" @ONLY)
  list(APPEND header_sources ${source})
endforeach()
set(planted_header ${PROJECT_SOURCE_DIR}/tests/architecture/planted_needs_another_header.h)
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/planted_header.cpp CONTENT "#include \"${planted_header}\"\n" @ONLY)
add_library(header_check_self_test OBJECT EXCLUDE_FROM_ALL ${PROJECT_BINARY_DIR}/generated/planted_header.cpp)
add_test(NAME architecture_headers_self_test
  COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target header_check_self_test)
set_tests_properties(architecture_headers_self_test PROPERTIES
  LABELS "slow;architecture" PASS_REGULAR_EXPRESSION "error: " RUN_SERIAL ON TIMEOUT 600)
if(header_sources)
  add_library(header_check OBJECT EXCLUDE_FROM_ALL ${header_sources})
  tellurion_use_warnings(header_check)
  target_link_libraries(header_check PRIVATE tellurion::globe tellurion::prepare PkgConfig::EPOXY)
  if(TELLURION_GDAL)
    target_link_libraries(header_check PRIVATE GDAL::GDAL PROJ::proj)
  endif()
  add_test(NAME architecture_headers COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target header_check)
  set_tests_properties(architecture_headers PROPERTIES LABELS "slow;architecture" RUN_SERIAL ON TIMEOUT 1800)
endif()

# --- The installed package -------------------------------------------------------------------------------------------

add_test(NAME install_find_package COMMAND ${CMAKE_COMMAND}
  -DBUILD_DIR=${PROJECT_BINARY_DIR} -DSOURCE_DIR=${PROJECT_SOURCE_DIR} -DVERSION=${PROJECT_VERSION}
  -DCXX_COMPILER=${CMAKE_CXX_COMPILER} -DCXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
  -DSANITIZE=${TELLURION_SANITIZE}
  -P ${PROJECT_SOURCE_DIR}/tests/install/check_install.cmake)
set_tests_properties(install_find_package PROPERTIES LABELS "slow;install" RUN_SERIAL ON TIMEOUT 900)
