#include "pictura/apps/drawing.h"
