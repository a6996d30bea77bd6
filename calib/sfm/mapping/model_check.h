// calib/sfm/mapping/model_check.h -- whether matches contradict a model that another mapper made.
#pragma once
#include <string>

#include "calib/sfm/view_graph.h"
#include "calib/sfm_model.h"

namespace dtr::sfm {

/// Why a model of these matches must not be trusted, by the tests of the global mapper's own model
/// that ask matches and points, not how they were mapped (global_mapper.h, why_not): few of the
/// matches became points, a focal length is off the graph's known one by more than a factor of 2,
/// many matches lie in pairs that contradict its cameras, or a part of it hangs on the rest by too
/// few points of known depth to have its scale. `graph`: a focal length counts as known there where
/// pairs of photos agree on it. One clause; empty: it can be trusted. Images are found by their
/// names, features by their order. Throws std::invalid_argument where an image of the model is none
/// of the graph's or has other features.
std::string WhyContradicted(const ViewGraph& graph, const calib::SfmModel& model);

/// The same of a model whose images stand as rigs of known form say: what of it hangs on few points
/// has its position from its rig, and one image of repeated structure decides nothing. The whole of
/// the matches does.
std::string WhyRigsContradicted(const ViewGraph& graph, const calib::SfmModel& model);

}  // namespace dtr::sfm
