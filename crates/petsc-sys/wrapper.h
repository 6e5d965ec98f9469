// Numbers of quadruple precision, which PETSc has where gcc compiled it, are none of clang's, which reads this.
#define PETSC_SKIP_REAL___FLOAT128
#include <petscsys.h>
#include <petscvec.h>
#include <petscmat.h>
#include <petscksp.h>
#include <petscviewer.h>
