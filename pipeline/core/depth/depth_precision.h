// pipeline/core/depth/depth_precision.h -- how many bits the depth of a view needs.
#pragma once
#include <string>
#include <vector>

#include "dtr/types/view.h"

namespace dtr::pipeline {

/// Standard deviation of the rounding to 16 bits (png16-inverse over the map's own range) relative
/// to that of the depth itself: a tenth of the pixels are surer than what it is divided by. 0 where
/// the view has no depth or says nothing of its deviation.
double RoundingInSigmas(const View& view);

/// What rounding may be: it raises no more than a tenth of the pixels' deviations by over 0.5 %.
inline constexpr double kMaxRoundingInSigmas = 0.1;

/// Sets the coding of a view with depth: png16-inverse where 16 bits hold, else exr-float.
void ChooseDepthCoding(View& view);

/// One line: in how many of the views with depth floats were left out, or are needed; "" where no
/// view has depth or all depth is in other codings.
std::string SayDepthCodings(const std::vector<View>& views);

}  // namespace dtr::pipeline
