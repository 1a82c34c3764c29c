# find_package(meniscus) for other projects; tests/consumer builds against an installed copy.
include(CMakePackageConfigHelpers)

install(TARGETS meniscus EXPORT meniscusTargets)
install(TARGETS meniscus_options EXPORT meniscusTargets)
install(DIRECTORY src/meniscus DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(EXPORT meniscusTargets NAMESPACE meniscus:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/meniscus)
configure_package_config_file(cmake/meniscusConfig.cmake.in ${CMAKE_BINARY_DIR}/meniscusConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/meniscus)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/meniscusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/meniscusConfig.cmake ${CMAKE_BINARY_DIR}/meniscusConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/meniscus)
if(MENISCUS_BUILD_APPS)
  install(TARGETS meniscus_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
