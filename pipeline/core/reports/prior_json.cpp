#include "pipeline/core/reports/prior_json.h"

#include <nlohmann/json.hpp>

#include "pipeline/core/reports/text.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

const char* NameOf(stereo::ViewPrior::Fit fit) {
  switch (fit) {
    case stereo::ViewPrior::Fit::kFits:
      return "fits";
    case stereo::ViewPrior::Fit::kFewPoints:
      return "few points";
    case stereo::ViewPrior::Fit::kDiffers:
      return "differs";
  }
  return "";
}

}  // namespace

Json PriorJson(const DepthPriorChoice& choice) {
  if (!choice.given()) return nullptr;
  Json json{{"folder", choice.folder.filename().string()}};
  if (choice.unit) json["unit"] = *choice.unit;
  if (choice.kind) json["kind"] = *choice.kind == DepthKind::kPlaneZ ? "z" : "ray";
  return json;
}

Json JsonOf(const DepthPriorReport& report) {
  const stereo::PriorAgreement& found = report.agreement;
  Json json{{"photos", report.photos},          {"maps", found.views.size()},
            {"points", found.points},           {"scale", found.scale},
            {"scale_sigma", found.scale_sigma}, {"noise", found.noise},
            {"outliers", found.outliers},       {"divided_by", report.divided_by},
            {"by_distance", Json::array()},     {"views", Json::array()}};
  for (const stereo::PriorBin& bin : found.by_distance) {
    json["by_distance"].push_back({{"near_z", bin.near_z},
                                   {"far_z", bin.far_z},
                                   {"points", bin.points},
                                   {"bias", bin.bias},
                                   {"noise", bin.noise}});
  }
  for (size_t i = 0; i < found.views.size(); ++i) {
    const stereo::ViewPrior& view = found.views[i];
    json["views"].push_back({{"name", report.names[i]},
                             {"points", view.points},
                             {"ratio", view.ratio},
                             {"noise", view.noise},
                             {"outliers", view.outliers},
                             {"fit", NameOf(view.fit)}});
  }
  return json;
}

std::string ToJson(const DepthPriorReport& report) { return Text(JsonOf(report)); }

}  // namespace dtr::pipeline
