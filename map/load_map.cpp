#include "pictura/map/load_map.h"
