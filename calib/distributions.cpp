#include "calib/distributions.h"

#include <cmath>
#include <limits>

namespace dtr::calib {
namespace {

constexpr int kMaxTerms = 100'000;
constexpr double kPrecision = 1e-15;
constexpr double kTiny = 1e-300;

// Continued fraction b0 + a1 / (b1 + a2 / (b2 + ...)) by Lentz's method as Thompson & Barnett
// (1986) modified it; `term(i, &a, &b)` for i >= 1.
template <typename Term>
double ContinuedFraction(double b0, const Term& term) {
  double value = b0 != 0 ? b0 : kTiny, c = value, d = 0;
  for (int i = 1; i < kMaxTerms; ++i) {
    double a = 0, b = 0;
    term(i, &a, &b);
    d = b + a * d;
    if (d == 0) d = kTiny;
    c = b + a / c;
    if (c == 0) c = kTiny;
    d = 1 / d;
    const double change = c * d;
    value *= change;
    if (std::abs(change - 1) < kPrecision) break;
  }
  return value;
}

// Regularised incomplete gamma functions (Abramowitz & Stegun 6.5.29 and 6.5.31): upper tail.
double GammaTail(double a, double x) {
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < kMaxTerms && term > kPrecision * sum; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    return 1 - front * sum;
  }
  const double fraction = ContinuedFraction(x + 1 - a, [&](int i, double* num, double* den) {
    *num = -i * (i - a);
    *den = x + 2 * i + 1 - a;
  });
  return front / fraction;
}

// Regularised incomplete beta function I_x(a, b) (Abramowitz & Stegun 26.5.8).
double Beta(double x, double a, double b) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - Beta(1 - x, b, a);
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x)) /
                       a;
  const double fraction = ContinuedFraction(1, [&](int i, double* num, double* den) {
    const int m = i / 2;
    *num = i % 2 == 0 ? m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
                      : -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    *den = 1;
  });
  return front / fraction;
}

}  // namespace

double ChiSquaredSurvival(double x, double freedom) {
  if (std::isnan(x)) return x;
  if (!(x > 0)) return 1;
  if (std::isinf(x)) return 0;
  return GammaTail(freedom / 2, x / 2);
}

double FisherSurvival(double x, double freedom_above, double freedom_below) {
  if (std::isnan(x)) return x;
  if (!(x > 0)) return 1;
  if (std::isinf(x)) return 0;
  // The tail itself, not one less the rest, so that small ones keep their digits.
  return Beta(freedom_below / (freedom_below + freedom_above * x), freedom_below / 2,
              freedom_above / 2);
}

double ChiSquaredLimit(double p, double freedom) {
  double low = 0, high = freedom + 10;
  while (ChiSquaredSurvival(high, freedom) > p) high *= 2;
  for (int i = 0; i < 200 && high - low > 1e-12 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (ChiSquaredSurvival(middle, freedom) > p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double RootOfVariance(double variance) {
  return std::isnan(variance) ? variance : std::sqrt(std::max(0.0, variance));
}

}  // namespace dtr::calib
