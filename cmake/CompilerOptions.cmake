# How our own code is compiled. Strict floating point, but loops may vectorise: docs/decisions/0004.
add_library(meniscus_options INTERFACE)
target_compile_features(meniscus_options INTERFACE cxx_std_20)
target_compile_options(meniscus_options INTERFACE -fno-math-errno -fno-trapping-math -ffp-contract=off)

# Warnings are for our code only: third-party headers come in as SYSTEM.
add_library(meniscus_warnings INTERFACE)
target_compile_options(meniscus_warnings INTERFACE -Wall -Wextra -Wshadow -Wno-psabi $<$<BOOL:${MENISCUS_WERROR}>:-Werror>)

if(MENISCUS_SANITIZE)
  target_compile_options(meniscus_options INTERFACE -fsanitize=${MENISCUS_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(meniscus_options INTERFACE -fsanitize=${MENISCUS_SANITIZE})
endif()

# Third-party trees are large: share compiled objects between build folders where ccache is there.
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE_PROGRAM})
endif()
