// Whether a symmetric matrix has negative curvature, by an iterative method.
#pragma once
#include <petscpc.h>

namespace bs {

/// Collective. Conjugate gradients on S w = b, preconditioned by P: the first of their directions w with w.S w <= 0, within `most` iterations.
/// found: false where there was none, or P is not positive definite.
PetscErrorCode find_negative_curvature(Mat S, PC P, Vec b, PetscInt most, Vec w, bool* found);

}  // namespace bs
