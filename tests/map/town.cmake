find_package(pugixml REQUIRED)
pictura_add_test(procedural_town SOURCES procedural_town_test.cpp LINK pictura::map pugixml::pugixml)
