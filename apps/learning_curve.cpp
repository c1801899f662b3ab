#include "pictura/apps/learning_curve.h"
