#include "pictura/simulator/fields.h"
