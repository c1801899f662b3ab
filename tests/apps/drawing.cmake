pictura_add_test(drawing SOURCES drawing_test.cpp LINK pictura::drawing)
