#include "dtr/io/shared_files.h"

#include <gtest/gtest.h>

#include <string>

namespace dtr::io {
namespace {

StoredFile FileCalled(const std::string& path, const std::string& sha256) {
  StoredFile file;
  file.path = path;
  file.sha256 = sha256;
  file.bytes = 7;
  return file;
}

View ViewOf(const std::string& id, const std::string& image_sha256) {
  View view;
  view.id = id;
  view.role = ViewRole::kSource;
  view.image_file = FileCalled("images/" + id + ".png", image_sha256);
  view.depth_file = FileCalled("depth/" + id + ".dtz", "depth of " + id);
  return view;
}

TEST(SharedFiles, EqualContentIsTheFirstFileAtAllTimeSteps) {
  DtrSet set;
  set.frames.resize(2);
  set.frames[0].views = {ViewOf("a_0", "still")};
  set.frames[1].views = {ViewOf("a_1", "still"), ViewOf("b_1", "moved")};
  ShareEqualFiles(set);
  EXPECT_EQ(set.frames[0].views[0].image_file->path, "images/a_0.png");
  EXPECT_EQ(set.frames[1].views[0].image_file->path, "images/a_0.png");
  EXPECT_EQ(set.frames[1].views[0].depth_file->path, "depth/a_1.dtz");
  EXPECT_EQ(set.frames[1].views[1].image_file->path, "images/b_1.png");
}

TEST(SharedFiles, HeldOutViewsAndOtherSizesKeepTheirs) {
  DtrSet set;
  set.frames.resize(2);
  set.frames[0].views = {ViewOf("a_0", "")};
  set.frames[1].views = {ViewOf("a_1", "")};
  for (Frame& frame : set.frames) frame.views[0].role = ViewRole::kHeldOut;
  ShareEqualFiles(set);
  EXPECT_EQ(set.frames[1].views[0].image_file->path, "images/a_1.png");
  for (Frame& frame : set.frames) frame.views[0].role = ViewRole::kSource;
  set.frames[1].views[0].image_file->bytes = 8;
  ShareEqualFiles(set);
  EXPECT_EQ(set.frames[1].views[0].image_file->path, "images/a_1.png");
}

}  // namespace
}  // namespace dtr::io
