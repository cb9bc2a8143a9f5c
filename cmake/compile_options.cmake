# What every target of ours is compiled with. One place, so that the same input gives the same bytes everywhere.
add_library(filigree_options INTERFACE)
# GCC looks for memory to reuse from 128 MB on, which the precompiled headers alone take: up to a fifth of its time. Here
# it takes half of a core's share of the memory there is first: 0.6 to 2 GB (in kB).
cmake_host_system_information(RESULT heap_before_search QUERY TOTAL_PHYSICAL_MEMORY) # MB
cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
math(EXPR heap_before_search "${heap_before_search} * 1000 / (2 * ${cores})")
if(heap_before_search GREATER 2000000)
  set(heap_before_search 2000000)
elseif(heap_before_search LESS 600000)
  set(heap_before_search 600000)
endif()
target_compile_options(filigree_options INTERFACE
  -Wall -Wextra -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread -Wno-free-nonheap-object  # false alarms about std::string and std::vector, GCC 12
  $<$<CXX_COMPILER_ID:Clang>:-Wno-unknown-warning-option -Wno-bitwise-instead-of-logical -Wno-shadow>  # clang's finds names of other sources in a unity build
  -Wshadow -Wconversion -Wno-sign-conversion -Wno-psabi
  -ffp-contract=off      # no fused multiply-add: the same bytes whatever the processor has
  $<$<BOOL:${FILIGREE_STRICT}>:-Werror>
  $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=${heap_before_search}>)
if(CMAKE_UNITY_BUILD) # sources look like headers then
  target_compile_options(filigree_options INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>)
endif()
if(BUILD_SHARED_LIBS) # calls of our own stay direct, as in a static library
  target_compile_options(filigree_options INTERFACE -fno-semantic-interposition)
  target_link_options(filigree_options INTERFACE -Wl,-Bsymbolic-functions)
endif()
if(FILIGREE_FUZZ)
  target_compile_options(filigree_options INTERFACE -fsanitize=fuzzer-no-link)
endif()
if(FILIGREE_SANITIZE)
  target_compile_options(filigree_options INTERFACE -fsanitize=${FILIGREE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(filigree_options INTERFACE -fsanitize=${FILIGREE_SANITIZE})
endif()

# For scenes, what shows them, programs and the report, which say what is to be done: what takes time is below them, and
# -O1 compiles sooner.
# Not with static libraries: the linker would keep the programs' copies of templates.
add_library(filigree_thin_options INTERFACE)
target_link_libraries(filigree_thin_options INTERFACE filigree_options)
if(BUILD_SHARED_LIBS)
  target_compile_options(filigree_thin_options INTERFACE $<$<CONFIG:Release>:-O1>)
endif()

# What xxHash says always has to be inlined is an error at -Og, the preset dev's.
target_compile_definitions(filigree_options INTERFACE $<$<CONFIG:Debug>:XXH_NO_INLINE_HINTS=1>)
if(FILIGREE_COVERAGE) # of the library's sources alone: to count in Eigen and the standard library is dear, and nobody asks
  target_compile_options(filigree_options INTERFACE --coverage -fprofile-abs-path "-fprofile-filter-files=.*/src/filigree/.*")
  target_link_options(filigree_options INTERFACE --coverage)
endif()

# In a unity build all of a target is one unit, for which a precompiled header costs more than it saves; else the headers
# named are precompiled.
function(compile_as_one target)
  if(CMAKE_UNITY_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 0)
  else()
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()
