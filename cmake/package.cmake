# Manual pages, made from the programs' own help.
find_program(FILIGREE_HELP2MAN help2man DOC "Makes the studio's manual page")
if(TARGET filigree_cli)
  set(manual_pages ${PROJECT_BINARY_DIR}/man1)
  set(programs -DPROGRAM=$<TARGET_FILE:filigree_cli>)
  if(TARGET filigree_studio AND FILIGREE_HELP2MAN)
    list(APPEND programs -DSTUDIO=$<TARGET_FILE:filigree_studio> -DHELP2MAN=${FILIGREE_HELP2MAN})
    set(and_studio filigree_studio)
  endif()
  add_custom_command(OUTPUT ${manual_pages}/filigree.1.gz
    COMMAND ${CMAKE_COMMAND} -DFOLDER=${manual_pages} ${programs} -P ${CMAKE_CURRENT_LIST_DIR}/manual_pages.cmake
    DEPENDS filigree_cli ${and_studio} ${CMAKE_CURRENT_LIST_DIR}/manual_pages.cmake
    COMMENT "Writing manual pages" VERBATIM)
  add_custom_target(manual_pages ALL DEPENDS ${manual_pages}/filigree.1.gz)
  install(DIRECTORY ${manual_pages} DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT programs OPTIONAL)
endif()

# Debian packages, by scripts/package: the programs, the library, the development files, the Python module.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME filigree)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The Filigree authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(libraries ${PROJECT_BINARY_DIR}/src/filigree)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${libraries} ${libraries}/render ${libraries}/scene ${libraries}/present)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL programs library development)
set(CPACK_COMPONENTS_GROUPING IGNORE)

set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME filigree)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAMS_DESCRIPTION "${PROJECT_DESCRIPTION}: the programs filigree and filigree-studio")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS "ffmpeg, fonts-dejavu-core")
set(CPACK_COMPONENT_PROGRAMS_DEPENDS library)

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libfiligree${filigree_soversion})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "${PROJECT_DESCRIPTION}: the library")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libfiligree-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "${PROJECT_DESCRIPTION}: headers, and what CMake and pkg-config need")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF) # no program in it, and CPack would start two processes a header
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS library)

if(TARGET filigree_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  math(EXPR next_python "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-filigree)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "${PROJECT_DESCRIPTION}: the Python module")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_python}), python3-numpy")
  set(CPACK_COMPONENT_PYTHON_DEPENDS library)
endif()

# Our licence, and those of the libraries whose headers are compiled in, which scripts/package collects.
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(folder ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${folder} RENAME copyright COMPONENT ${component})
  if(NOT component STREQUAL development) # which has no binary
    install(DIRECTORY ${PROJECT_BINARY_DIR}/licences/ DESTINATION ${folder}/licences COMPONENT ${component} OPTIONAL)
  endif()
endforeach()

include(CPack)
