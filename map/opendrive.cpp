#include "pictura/map/opendrive.h"
