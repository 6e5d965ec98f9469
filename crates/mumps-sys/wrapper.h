#include <dmumps_c.h>
#include <smumps_c.h>
