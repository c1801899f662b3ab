#include "pictura/training/training.h"
