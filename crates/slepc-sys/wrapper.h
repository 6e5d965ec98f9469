#include <slepceps.h>
#include <slepcpep.h>
