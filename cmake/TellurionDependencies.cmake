# The libraries that Tellurion's rooms link to. Included by the project and by the installed package, which each
# define tellurion_dependency(<package> ...) and tellurion_pkg_config_dependency(<PREFIX> <module>) first.

tellurion_dependency(Threads)
tellurion_dependency(glm)
tellurion_dependency(fmt)
tellurion_dependency(spdlog)
tellurion_dependency(tomlplusplus)
tellurion_dependency(nlohmann_json)
tellurion_dependency(CURL)
tellurion_dependency(SQLite3)
tellurion_dependency(ZLIB)
tellurion_dependency(PkgConfig)
tellurion_pkg_config_dependency(EPOXY epoxy)
tellurion_pkg_config_dependency(EGL egl)
if(TELLURION_GDAL)
  tellurion_dependency(GDAL CONFIG)
  tellurion_dependency(PROJ CONFIG)
endif()
