#include "calib/bundle/covariance_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/bundle/lens_params.h"

namespace dtr::calib {
namespace {

using Json = nlohmann::ordered_json;

Json Rows(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (long i = 0; i < matrix.rows(); ++i) {
    rows.push_back(std::vector<double>(matrix.row(i).begin(), matrix.row(i).end()));
  }
  return rows;
}

}  // namespace

std::string ToJson(const Adjusted& adjusted, const BundleCovariance& covariance) {
  const Bundle& bundle = adjusted.bundle;
  const bool known = covariance.computed && covariance.determined;
  Json json;
  json["sigma_px"] = std::isfinite(covariance.sigma_px) ? Json(covariance.sigma_px) : Json(nullptr);
  const bool has_condition = covariance.computed && std::isfinite(covariance.condition);
  json["computed"] = covariance.computed;  // false: more than kMaxUnknowns
  json["condition"] = has_condition ? Json(covariance.condition) : Json(nullptr);
  json["gauge_freedom"] = covariance.computed ? Json(covariance.gauge_freedom) : Json(nullptr);
  json["determined"] = covariance.computed ? Json(covariance.determined) : Json(nullptr);
  json["lenses"] = Json::array();
  json["cameras"] = Json::array();
  for (size_t i = 0; known && i < bundle.lenses.size(); ++i) {
    const auto all = ParameterNames(bundle.lenses[i].model);
    std::vector<std::string> names;
    for (const int k : covariance.free_params[i]) names.push_back(all[static_cast<size_t>(k)]);
    const auto count = static_cast<long>(names.size());
    const long at = covariance.lens_at[i];
    json["lenses"].push_back(
        {{"names", names}, {"matrix", Rows(covariance.matrix.block(at, at, count, count))}});
  }
  for (size_t i = 0; known && i < bundle.images.size(); ++i) {
    json["cameras"].push_back({{"name", bundle.images[i].name},
                               {"matrix", Rows(covariance.OfImage(static_cast<int>(i)))}});
  }
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
