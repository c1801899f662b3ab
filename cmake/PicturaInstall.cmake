# install(EXPORT): find_package(pictura) defines pictura::common, pictura::map, pictura::simulator, pictura::renderer ...
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(installed pictura_flags pictura_common pictura_map pictura_simulator pictura_backend_cpu pictura_simulator_cpu
              pictura_renderer pictura_make_simulator)
if(PICTURA_HAS_CUDA)
  list(APPEND installed pictura_cuda_flags pictura_backend_cuda pictura_simulator_cuda)
endif()
if(PICTURA_HAS_GL)
  list(APPEND installed pictura_backend_gl)
endif()
install(TARGETS ${installed} EXPORT pictura ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS pictura RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
foreach(folder backends common map simulator)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pictura/${folder}
    FILES_MATCHING PATTERN "*.h" PATTERN "cuda" EXCLUDE PATTERN "controllers" EXCLUDE
    PATTERN "toml_fields.h" EXCLUDE PATTERN "make_learner.h" EXCLUDE)
endforeach()
install(FILES ${PICTURA_INCLUDE_DIR}/pictura/version.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/pictura)
install(EXPORT pictura NAMESPACE pictura:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/pictura)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/picturaConfig.cmake.in
  ${PROJECT_BINARY_DIR}/picturaConfig.cmake INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/pictura)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/picturaConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/picturaConfig.cmake ${PROJECT_BINARY_DIR}/picturaConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/pictura)
