// pipeline/core/run/side_by_side.h -- work on stored views, several of them at a time.
#pragma once
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/view.h"

namespace dtr::pipeline {

/// Indices of the source views with stored depth.
std::vector<int> ViewsWithDepth(std::span<const View> views);

/// Calls `body(k)` for every k in [0, count): as many at a time as the room allows, one always,
/// where item k takes bytes(k). They are a stage of this name (empty: of the stage that runs),
/// which ends between items where it is asked to.
void SideBySide(size_t count, const std::string& stage, double memory_gb,
                const std::function<double(size_t k)>& bytes, Progress& progress,
                const std::function<void(size_t k)>& body);

/// The same for views, where which[k] is the index of one whose pixels body(k) loads.
void ForViews(std::span<const View> views, std::span<const int> which, const std::string& stage,
              double memory_gb, Progress& progress, const std::function<void(size_t k)>& body);

/// A copy of the view with its stored pixels, read by one thread: others read other views.
View Loaded(const View& view, const std::filesystem::path& folder, io::LoadOptions load = {});

}  // namespace dtr::pipeline
