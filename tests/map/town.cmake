find_package(pugixml REQUIRED)
pictura_add_test(procedural_town SOURCES procedural_town_test.cpp opendrive_text.cpp LINK pictura::map pugixml::pugixml)
pictura_add_test(procedural_town_map SOURCES procedural_town_map_test.cpp LINK pictura::map pictura_eigen)
pictura_add_test(opendrive_writer SOURCES opendrive_writer_test.cpp LINK pictura::map)
