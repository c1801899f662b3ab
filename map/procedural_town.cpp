#include "pictura/map/procedural_town.h"
