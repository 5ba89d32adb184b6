# The runtime's text as an array, from which each exported file begins.
set(text ${PROJECT_SOURCE_DIR}/extensions/export/runtime/runtime.c)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${text})
file(READ ${text} bytes HEX)
string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/export_runtime.c
     CONTENT "extern const char HycoExportRuntime[];\nconst char HycoExportRuntime[] = {@bytes@0};\n" @ONLY)
list(APPEND HYCO_SOURCES ${PROJECT_BINARY_DIR}/export_runtime.c)
