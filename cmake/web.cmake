# The page of `filigree export --web`: web/src and three.js as one script, and what goes beside it, in share/filigree/web
# of the build tree and of the installed one. Without node or web/node_modules (scripts/setup fetches them) there is no
# page, and the program says so when it is asked for one. Without clang for WebAssembly the page plays no streams, and
# there are no live pages.

set(web ${PROJECT_SOURCE_DIR}/web)
set(esbuild ${web}/node_modules/esbuild/bin/esbuild)
set(three ${web}/node_modules/three)
find_program(FILIGREE_NODE node DOC "Node.js, which bundles the web page")
file(GLOB bundler CONFIGURE_DEPENDS ${esbuild})   # so that a build notices when the packages come

# From the program's folder, the same in both trees.
file(RELATIVE_PATH web_from_program /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_DATADIR}/filigree/web)
target_compile_definitions(filigree_cli PRIVATE FILIGREE_WEB_FROM_PROGRAM="${web_from_program}")

if(FILIGREE_NODE AND bundler)
  cmake_path(SET web_folder NORMALIZE ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/${web_from_program})
  file(GLOB web_sources CONFIGURE_DEPENDS ${web}/src/*.js ${web}/filigree/three_skin.js)

  # The library's decoder for the page, with nothing of the system in it.
  set(decoder ${CMAKE_CURRENT_BINARY_DIR}/web/decoder.wasm)
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/web)
  find_program(FILIGREE_WASM_CLANG clang++-16 DOC "Clang, which compiles the page's decoder")
  set(wasm_library /usr/lib/llvm-16/lib/wasm32-wasi)
  file(GLOB wasm_standard CONFIGURE_DEPENDS ${wasm_library}/libc++.a)
  if(FILIGREE_WASM_CLANG AND wasm_standard)
    set(decoder_sources ${web}/decoder/decoder.cpp)
    foreach(name pack/clip_code pack/closed_map pack/connectivity_code pack/driver_code pack/face_code
                 pack/geometry_code pack/level_reader pack/symbols pack/vertex_rings mesh/edges
                 mesh/triangle_point)
      list(APPEND decoder_sources ${PROJECT_SOURCE_DIR}/src/filigree/${name}.cpp)
    endforeach()
    foreach(name base clip symbols) # the runtime's C compiles as C++, too
      list(APPEND decoder_sources ${PROJECT_SOURCE_DIR}/runtime/rt_${name}.c)
    endforeach()
    # As one source: the headers are read once.
    list(TRANSFORM decoder_sources REPLACE "(.+)" "#include \"\\1\"\n" OUTPUT_VARIABLE decoder_lines)
    string(JOIN "" decoder_lines ${decoder_lines})
    set(whole_decoder ${CMAKE_CURRENT_BINARY_DIR}/web/decoder.cpp)
    file(CONFIGURE OUTPUT ${whole_decoder} CONTENT "${decoder_lines}" @ONLY)
    file(GLOB decoder_headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/filigree/pack/*.h
         ${PROJECT_SOURCE_DIR}/runtime/*.h)
    find_path(FILIGREE_EIGEN_FOLDER Eigen/Core PATH_SUFFIXES eigen3)
    add_custom_command(
      OUTPUT ${decoder}
      COMMAND ${FILIGREE_WASM_CLANG} --target=wasm32-wasi --sysroot=/usr -mexec-model=reactor -std=c++20 -O3
              -ffp-contract=off -fno-exceptions -fno-rtti -ffunction-sections -fdata-sections -DNDEBUG
              -I ${PROJECT_SOURCE_DIR}/include -I ${PROJECT_SOURCE_DIR}/src -I ${PROJECT_SOURCE_DIR}
              -nostdinc++ -isystem /usr/lib/llvm-16/include/wasm32-wasi/c++/v1 -isystem /usr/include/wasm32-wasi
              -isystem ${FILIGREE_EIGEN_FOLDER} ${whole_decoder} -o ${decoder} -L${wasm_library} -L/usr/lib/wasm32-wasi
              -Wl,--gc-sections -Wl,--strip-all
      DEPENDS ${decoder_sources} ${decoder_headers}
      COMMENT "Compiling the web page's decoder" VERBATIM)
    target_compile_definitions(filigree_cli PRIVATE FILIGREE_WEB_STREAMS)
  else()
    file(WRITE ${decoder} "")
    message(STATUS "The web page plays no streams: clang 16 for WebAssembly is missing; scripts/setup installs it")
  endif()
  add_custom_command(
    OUTPUT ${web_folder}/filigree.js
    COMMAND ${FILIGREE_NODE} ${esbuild} ${web}/src/main.js --bundle --minify --format=iife --target=es2022
            --legal-comments=none --log-level=warning --outfile=${web_folder}/filigree.js
            --loader:.wasm=binary --alias:filigree-decoder.wasm=${decoder}
    DEPENDS ${web_sources} ${web}/package-lock.json ${decoder}
    COMMENT "Bundling the web page" VERBATIM)
  add_custom_command(
    OUTPUT ${web_folder}/index.html ${web_folder}/filigree.css
    COMMAND ${CMAKE_COMMAND} -E copy ${web}/index.html ${web_folder}/index.html
    COMMAND ${CMAKE_COMMAND} -E copy ${web}/filigree.css ${web_folder}/filigree.css
    DEPENDS ${web}/index.html ${web}/filigree.css
    VERBATIM)
  # The page in which bodies move: the library's physics in its worker, and the runtime that restores.
  set(live_files "")
  if(FILIGREE_WASM_CLANG AND wasm_standard)
    set(live ${CMAKE_CURRENT_BINARY_DIR}/web/live)
    file(GLOB_RECURSE live_sources CONFIGURE_DEPENDS ${web}/live/* ${PROJECT_SOURCE_DIR}/src/filigree/physics/*
         ${PROJECT_SOURCE_DIR}/src/filigree/core/* ${PROJECT_SOURCE_DIR}/include/filigree/*)
    file(GLOB runtime_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/runtime/*.[ch] ${web}/filigree/*)
    add_custom_command(
      OUTPUT ${live}/live.wasm ${live}/live.wasm.gz
      COMMAND ${PROJECT_SOURCE_DIR}/scripts/wasm live ${live}/live.wasm
      DEPENDS ${live_sources} ${PROJECT_SOURCE_DIR}/scripts/wasm
      COMMENT "Compiling the physics of live pages" VERBATIM)
    add_custom_command(
      OUTPUT ${live}/npm/filigree/wasm.js
      COMMAND ${PROJECT_SOURCE_DIR}/scripts/npm ${live}/npm
      DEPENDS ${runtime_sources} ${PROJECT_SOURCE_DIR}/scripts/npm
      COMMENT "Building the npm package" VERBATIM)
    set(bundle ${CMAKE_COMMAND} -E env NODE_PATH=${web}/node_modules ${FILIGREE_NODE} ${esbuild} --bundle --minify
        --format=iife --target=es2022 --legal-comments=none --log-level=warning)
    add_custom_command(
      OUTPUT ${web_folder}/live.js ${web_folder}/live.html
      COMMAND ${bundle} ${web}/live/worker.js --outfile=${live}/worker.txt --loader:.gz=binary
              --alias:filigree-live.wasm.gz=${live}/live.wasm.gz
      COMMAND ${bundle} ${web}/live/main.js --outfile=${web_folder}/live.js --loader:.txt=text
              --alias:filigree-live-worker.txt=${live}/worker.txt --alias:filigree=${live}/npm/filigree/filigree.js
              --alias:filigree/three=${live}/npm/filigree/three.js
      COMMAND ${CMAKE_COMMAND} -E copy ${web}/live/live.html ${web_folder}/live.html
      DEPENDS ${live}/live.wasm ${live}/npm/filigree/wasm.js ${live_sources} ${web_sources} ${web}/package-lock.json
      COMMENT "Bundling the live page" VERBATIM)
    set(live_files ${web_folder}/live.js ${web_folder}/live.html)
  endif()

  # The licences of all that the script holds, for the page's folder.
  set(notices "This page holds the programs below. Their licences ask that these texts go with it.\n")
  function(add_notice name file otherwise)
    if(EXISTS ${file})
      file(READ ${file} text)
    else()
      set(text "${otherwise}\n")
    endif()
    string(REPEAT "-" 78 line)
    string(APPEND notices "\n${line}\n${name}\n${line}\n\n${text}")
    set(notices "${notices}" PARENT_SCOPE)
  endfunction()
  add_notice("Filigree" ${PROJECT_SOURCE_DIR}/LICENSE "MIT")
  add_notice("three.js, which draws" ${three}/LICENSE "MIT")
  if(FILIGREE_WASM_CLANG AND wasm_standard)
    set(notes /usr/share/doc)
    add_notice("Eigen, in the decoder of streams. Its source is Debian's package eigen3, or eigen.tuxfamily.org."
               ${notes}/libeigen3-dev/copyright "Mozilla Public License 2.0")
    add_notice("libc++ of LLVM, in the decoder of streams" ${notes}/libc++-16-dev-wasm32/copyright
               "Apache License 2.0 with LLVM exceptions")
    add_notice("WASI libc, in the decoder of streams" ${notes}/wasi-libc/copyright "CC0, MIT, BSD")
  endif()
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/web/licenses.txt "${notices}")
  file(COPY ${CMAKE_CURRENT_BINARY_DIR}/web/licenses.txt DESTINATION ${web_folder})
  set(web_files ${web_folder}/filigree.js ${web_folder}/index.html ${web_folder}/filigree.css)
  add_custom_target(filigree_web DEPENDS ${web_files})
  add_dependencies(filigree_cli filigree_web)
  install(FILES ${web_files} ${web_folder}/licenses.txt DESTINATION ${CMAKE_INSTALL_DATADIR}/filigree/web COMPONENT programs)
  # Live pages take more than a processor minute to build. So only builds of the program make them, and the tests of label `live`.
  add_custom_target(filigree_live DEPENDS ${live_files})
  if(live_files)
    install(FILES ${live_files} DESTINATION ${CMAKE_INSTALL_DATADIR}/filigree/web COMPONENT programs OPTIONAL)
  endif()
else()
  add_custom_target(filigree_live)
  message(STATUS "No web page: node or web/node_modules is missing; scripts/setup installs them")
endif()
