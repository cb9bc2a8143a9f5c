# The page of `filigree export --web`: web/src and three.js as one script, and what goes beside it, in share/filigree/web
# of the build tree and of the installed one. Without node or web/node_modules (scripts/setup fetches them) there is no
# page, and the program says so when it is asked for one.

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
  file(GLOB web_sources CONFIGURE_DEPENDS ${web}/src/*.js)
  add_custom_command(
    OUTPUT ${web_folder}/filigree.js
    COMMAND ${FILIGREE_NODE} ${esbuild} ${web}/src/main.js --bundle --minify --format=iife --target=es2022
            --legal-comments=none --log-level=warning --outfile=${web_folder}/filigree.js
    DEPENDS ${web_sources} ${web}/package-lock.json
    COMMENT "Bundling the web page" VERBATIM)
  add_custom_command(
    OUTPUT ${web_folder}/index.html ${web_folder}/filigree.css ${web_folder}/three-license.txt
    COMMAND ${CMAKE_COMMAND} -E copy ${web}/index.html ${web_folder}/index.html
    COMMAND ${CMAKE_COMMAND} -E copy ${web}/filigree.css ${web_folder}/filigree.css
    COMMAND ${CMAKE_COMMAND} -E copy ${three}/LICENSE ${web_folder}/three-license.txt
    DEPENDS ${web}/index.html ${web}/filigree.css
    VERBATIM)
  set(web_files ${web_folder}/filigree.js ${web_folder}/index.html ${web_folder}/filigree.css
      ${web_folder}/three-license.txt)
  add_custom_target(filigree_web DEPENDS ${web_files})
  add_dependencies(filigree_cli filigree_web)
  install(FILES ${web_files} DESTINATION ${CMAKE_INSTALL_DATADIR}/filigree/web COMPONENT programs)
else()
  message(STATUS "No web page: node or web/node_modules is missing; scripts/setup installs them")
endif()
