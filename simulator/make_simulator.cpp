#include "pictura/simulator/simulator.h"
