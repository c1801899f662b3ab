#include "pictura/common/renderer.h"
