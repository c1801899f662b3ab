#include "pictura/map/map_geometry.h"
