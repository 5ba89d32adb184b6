# cmake --install build --prefix FOLDER installs the library, its headers, the command, its manual pages and completion, the files for pkg-config
# and CMake, and the examples; cpack makes a Debian package of the same files.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(at ${CMAKE_INSTALL_LIBDIR}/cmake/hyco)
set_target_properties(hyco hyco_command PROPERTIES INSTALL_RPATH_USE_LINK_PATH ON)
install(TARGETS hyco EXPORT hyco)
install(TARGETS hyco_command)
install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} PATTERN private EXCLUDE)
install(EXPORT hyco NAMESPACE hyco:: DESTINATION ${at})
configure_file(cmake/hycoConfig.cmake.in hycoConfig.cmake @ONLY)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/hycoConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/hycoConfig.cmake ${PROJECT_BINARY_DIR}/hycoConfigVersion.cmake DESTINATION ${at})

list(JOIN MPI_C_INCLUDE_DIRS " -I" HYCO_MPI_INCLUDES)
list(JOIN MPI_C_LIBRARIES " " HYCO_MPI_LIBRARIES)
list(JOIN HYCO_LIBRARIES " " HYCO_PRIVATE_LIBRARIES)
file(RELATIVE_PATH HYCO_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(cmake/hyco.pc.in hyco.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/hyco.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

# Manual pages and the shells' completions are made from the help of the commands.
install(CODE "execute_process(COMMAND sh \"${PROJECT_SOURCE_DIR}/cmake/manual\" \"$<TARGET_FILE:hyco_command>\" \"${PROJECT_BINARY_DIR}/manual\"
                              RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR \"the manual pages could not be made of $<TARGET_FILE:hyco_command>'s help\")
endif()")
install(DIRECTORY ${PROJECT_BINARY_DIR}/manual/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
install(FILES ${PROJECT_BINARY_DIR}/manual/hyco DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${PROJECT_BINARY_DIR}/manual/_hyco DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
install(FILES ${PROJECT_BINARY_DIR}/manual/hyco.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)

install(FILES README.md LICENSE CHANGELOG.md CONTRIBUTING.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN *.md PATTERN *.csv PATTERN *.png)
install(PROGRAMS scripts/meshes scripts/plot scripts/convert scripts/hyco.sbatch DESTINATION ${CMAKE_INSTALL_DOCDIR}/scripts)
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN *.msh EXCLUDE PATTERN *.h5 EXCLUDE PATTERN *.xdmf EXCLUDE)

# The headers of PETSc and SLEPc are needed only by programs that link hyco; the package therefore only recommends them.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hyco)
set(CPACK_PACKAGE_VENDOR "the hyco authors")
set(CPACK_PACKAGE_CONTACT "the hyco authors <hyco@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "reduced and full-order models of parametrised unilateral contact")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS openmpi-bin)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libpetsc-real-dev, libslepc-real-dev, libopenblas0-serial, gmsh, python3-matplotlib, python3-h5py")
set(CPACK_STRIP_FILES ON)
include(CPack)
