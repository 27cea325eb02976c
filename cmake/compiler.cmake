# Language, warnings, sanitizers, linker and compiler cache.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# Optimised, with enough debug information for backtraces and profiles.
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1 -DNDEBUG")

find_program(TELLURION_CCACHE ccache)
if(TELLURION_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${TELLURION_CCACHE})
endif()

find_program(TELLURION_MOLD mold)
if(TELLURION_MOLD)
  add_link_options(-fuse-ld=mold)
endif()
if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
  add_link_options(-Wl,--as-needed)
endif()

set(TELLURION_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize= (address,undefined or thread)")
if(TELLURION_SANITIZE)
  add_compile_options(-fsanitize=${TELLURION_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${TELLURION_SANITIZE})
endif()
if(TELLURION_SANITIZE OR CMAKE_BUILD_TYPE STREQUAL "Debug")
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
endif()

set(TELLURION_WARNINGS -Wall -Wextra -Wconversion -Wshadow -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  list(APPEND TELLURION_WARNINGS -Wno-restrict)  # false alarms on std::string, gcc bug 105651
endif()
if(TELLURION_SANITIZE AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  list(APPEND TELLURION_WARNINGS -Wno-maybe-uninitialized)  # false alarms in instrumented code
endif()

function(tellurion_use_warnings target)
  target_compile_options(${target} PRIVATE ${TELLURION_WARNINGS})
endfunction()
