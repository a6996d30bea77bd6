// SPEC 4.5, 4.6: weights of the views as logarithms. BLEND is one of the names below.
#define COSINE 0
#define EXPONENTIAL 1
#define ANGLE 2
#define INVERSE_ANGLE 3
#define K_NEAREST 4

uniform float exponent;         // n of COSINE
uniform float falloff;          // c of EXPONENTIAL, per radian
uniform int blend_k;            // k of K_NEAREST, power of INVERSE_ANGLE
uniform float max_angle_rad;
uniform float pixel_angle_rad;  // t_pixel

const float kNoWeight = -1e38;  // stands for minus infinity, which GLSL need not have
const float kHalfPi = 1.57079632679;

float LogOrNone(float weight) { return weight > 0.0 ? log(weight) : kNoWeight; }

// SPEC 4.8: what is left of a weight, of which the pixel's views have `total` together.
float FadedWeight(float weight, float factor, float total) {
  float others = max(total - weight, 0.0) + 1e-6 * total;
  return weight * factor * others / (others + (1.0 - factor) * weight);
}

// Logarithm of the weight at angle t >= 0 (radians); next_angle is t_(k+1).
float LogWeight(float t, float next_angle) {
#if BLEND == COSINE
  return t >= kHalfPi ? kNoWeight : exponent * log(max(cos(t), 1e-30));
#elif BLEND == EXPONENTIAL
  return -falloff * t;
#elif BLEND == ANGLE
  return LogOrNone(1.0 - t / max_angle_rad);
#elif BLEND == INVERSE_ANGLE
  return -float(blend_k) * log(t + pixel_angle_rad);
#else
  return next_angle > 0.0 ? LogOrNone(1.0 - t / next_angle) : kNoWeight;
#endif
}
