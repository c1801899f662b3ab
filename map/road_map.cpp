#include "pictura/map/road_map.h"
