// tests/support/analytic_scene.h -- views of simple shapes, where the tests look for them.
#pragma once
#include "datasets/exact/analytic_scene.h"
