#include "calib/bundle/covariance_report.h"

#include "calib/bundle/lens_params.h"

namespace dtr::calib {

CovarianceReport CovarianceReportOf(const Adjusted& adjusted, const BundleCovariance& covariance) {
  const Bundle& bundle = adjusted.bundle;
  CovarianceReport report{.sigma_px = covariance.sigma_px,
                          .computed = covariance.computed,
                          .condition = covariance.condition,
                          .gauge_freedom = covariance.gauge_freedom,
                          .determined = covariance.determined,
                          .lenses = {},
                          .cameras = {}};
  if (!covariance.computed || !covariance.determined) return report;
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const auto all = ParameterNames(bundle.lenses[i].model);
    LensCovariance lens;
    for (const int k : covariance.free_params[i]) {
      lens.names.push_back(all[static_cast<size_t>(k)]);
    }
    const auto count = static_cast<long>(lens.names.size());
    const long at = covariance.lens_at[i];
    lens.matrix = covariance.matrix.block(at, at, count, count);
    report.lenses.push_back(std::move(lens));
  }
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    report.cameras.push_back({bundle.images[i].name, covariance.OfImage(static_cast<int>(i))});
  }
  return report;
}

}  // namespace dtr::calib
