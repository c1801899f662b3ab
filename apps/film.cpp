#include "pictura/apps/film.h"
