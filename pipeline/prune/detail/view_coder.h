// pipeline/prune/detail/view_coder.h -- a set's views in another coding, tried and written.
#pragma once
#include <cstdint>
#include <filesystem>

#include "dtr/io/set_io.h"
#include "dtr/prune/coding.h"
#include "dtr/render/options.h"

namespace dtr::pipeline {

/// Stores views as a prune::Coding says. A depth map that is stored as coarsely already stays.
class ViewCoder {
 public:
  /// `original`: loaded, from `folder`; both must outlive this. Trials leave files in
  /// `trial_folder`, one view's at a time.
  ViewCoder(const DtrSet& original, std::filesystem::path folder,
            std::filesystem::path trial_folder, RenderOptions render);

  /// The whole set as a reader would get it, and its views' bytes.
  prune::CodedSet Try(const prune::Coding& coding) const;

  /// Writes a source view's files; the result has their entries and no pixels.
  View Write(const View& view, const prune::Coding& coding, io::SetWriter& writer) const;

 private:
  View Recoded(const View& view, const prune::Coding& coding) const;
  /// Puts there what a reader would get of `before`; its bytes.
  std::uint64_t TryView(View& view, const View& before, const prune::Coding& coding) const;
  StoredMesh MeshOf(const View& stored, const prune::Coding& coding) const;

  const DtrSet& original_;
  std::filesystem::path folder_, trial_folder_;
  RenderOptions render_;
};

}  // namespace dtr::pipeline
