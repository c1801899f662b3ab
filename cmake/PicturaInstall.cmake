# Installed components. find_package(pictura COMPONENTS renderer) defines pictura::renderer and pictura::common. The
# component simulator adds pictura::map, pictura::simulator and pictura::make_simulator. The component command is the
# program.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/pictura)
set(header_folder ${CMAKE_INSTALL_INCLUDEDIR}/pictura)

# pictura_install_component(NAME TARGETS...): installs the libraries of a component. Flags of this build are not
# exported.
function(pictura_install_component name)
  install(TARGETS ${ARGN} EXPORT pictura-${name} COMPONENT ${name}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${name}
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT pictura-${name} NAMESPACE pictura:: DESTINATION ${package_folder} COMPONENT ${name})
endfunction()
# pictura_install_headers(COMPONENT FOLDER [pattern options...])
function(pictura_install_headers component folder)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}/ DESTINATION ${header_folder}/${folder} COMPONENT ${component}
    FILES_MATCHING PATTERN "*.h" ${ARGN})
endfunction()

set(renderer_libraries pictura_common pictura_backend_cpu pictura_renderer)
if(PICTURA_HAS_CUDA)
  list(APPEND renderer_libraries pictura_backend_cuda)
endif()
if(PICTURA_HAS_GL)
  list(APPEND renderer_libraries pictura_backend_gl)
endif()
pictura_install_component(renderer ${renderer_libraries})
pictura_install_headers(renderer common PATTERN "cuda" EXCLUDE PATTERN "toml_fields.h" EXCLUDE PATTERN "json.h" EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/backends/make_renderer.h DESTINATION ${header_folder}/backends COMPONENT renderer)
install(FILES ${PICTURA_INCLUDE_DIR}/pictura/version.h DESTINATION ${header_folder} COMPONENT renderer)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/picturaConfig.cmake.in
  ${PROJECT_BINARY_DIR}/picturaConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/picturaConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/picturaConfig.cmake ${PROJECT_BINARY_DIR}/picturaConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT renderer)

if(PICTURA_ONLY_RENDERER)
  return()
endif()
set(simulator_libraries pictura_map pictura_simulator pictura_simulator_cpu pictura_make_simulator)
if(PICTURA_HAS_CUDA)
  list(APPEND simulator_libraries pictura_simulator_cuda)
endif()
pictura_install_component(simulator ${simulator_libraries})
# Installs only headers that call the importers, because the other headers include pugixml and Eigen.
install(FILES ${PROJECT_SOURCE_DIR}/map/opendrive/opendrive.h DESTINATION ${header_folder}/map/opendrive
  COMPONENT simulator)
install(FILES ${PROJECT_SOURCE_DIR}/map/procedural/procedural_town.h ${PROJECT_SOURCE_DIR}/map/procedural/town_options.h
  DESTINATION ${header_folder}/map/procedural COMPONENT simulator)
pictura_install_headers(simulator map PATTERN "opendrive" EXCLUDE PATTERN "lanelet2" EXCLUDE
  PATTERN "procedural" EXCLUDE
  PATTERN "womd" EXCLUDE PATTERN "gpudrive" EXCLUDE PATTERN "pufferdrive" EXCLUDE
  PATTERN "logged_scene.h" EXCLUDE PATTERN "conversion.h" EXCLUDE
  PATTERN "import.h" EXCLUDE PATTERN "polyline.h" EXCLUDE PATTERN "polyline_lanes.h" EXCLUDE PATTERN "stripes.h" EXCLUDE
  PATTERN "road_edges.h" EXCLUDE PATTERN "surface.h" EXCLUDE)
pictura_install_headers(simulator simulator)
install(FILES ${PROJECT_SOURCE_DIR}/backends/make_controller.h ${PROJECT_SOURCE_DIR}/backends/make_simulator.h
              ${PROJECT_SOURCE_DIR}/backends/upload_maps.h DESTINATION ${header_folder}/backends COMPONENT simulator)
install(TARGETS pictura RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
