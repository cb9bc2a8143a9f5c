# Manual pages, compressed, from what the programs say of their own options.
# Usage: cmake -DFOLDER=... -DPROGRAM=filigree [-DSTUDIO=filigree-studio -DHELP2MAN=...] -P manual_pages.cmake
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})

function(manual_page name)
  execute_process(COMMAND ${ARGN} OUTPUT_FILE ${FOLDER}/${name}.1 COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND gzip -9n ${FOLDER}/${name}.1 COMMAND_ERROR_IS_FATAL ANY)
endfunction()

execute_process(COMMAND ${PROGRAM} --man OUTPUT_VARIABLE main_page COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "filigree\\\\-[a-z]+" commands "${main_page}")
list(REMOVE_DUPLICATES commands)
manual_page(filigree ${PROGRAM} --man)
foreach(command IN LISTS commands)
  string(REGEX REPLACE ".*-" "" command ${command})
  manual_page(filigree-${command} ${PROGRAM} --man ${command})
endforeach()
if(STUDIO AND HELP2MAN)
  manual_page(filigree-studio ${HELP2MAN} --no-info --name "pulls a detailed mesh by its simple shape" ${STUDIO})
endif()
