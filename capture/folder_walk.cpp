#include "capture/folder_walk.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>
#include <system_error>

#include "capture/ingest.h"
#include "capture/names.h"
#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/utf8.h"
#include "dtr/io/image_io.h"

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

template <size_t N>
bool IsOneOf(const std::string& text, const std::array<std::string_view, N>& list) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

// What operating systems, file servers and recycle bins leave in folders.
bool IsSystemFolder(const std::string& name) {
  static constexpr std::array<std::string_view, 7> kNames{
      "@eadir",     "__macosx", "#recycle", "$recycle.bin", "system volume information",
      "lost+found", "#snapshot"};
  return IsOneOf(LowerCase(name), kNames);
}

bool IsSystemFile(const std::string& name) {
  static constexpr std::array<std::string_view, 5> kNames{"thumbs.db", "ehthumbs.db", "desktop.ini",
                                                          "zbthumbnail.info", "icon\r"};
  return IsOneOf(LowerCase(name), kNames);
}

int FilesBelow(const fs::path& folder) {
  int count = 0;
  std::error_code error;
  fs::recursive_directory_iterator entries(folder, error);
  for (; !error && entries != fs::recursive_directory_iterator(); entries.increment(error)) {
    std::error_code ignored;
    count += entries->is_regular_file(ignored);
  }
  return count;
}

class Walker {
 public:
  Walker(const fs::path& top, bool recurse) : top_(top), recurse_(recurse) {}

  FolderWalk Finish() {
    MarkRead(top_);
    List("");
    while (!links_.empty()) FollowFirstLink();
    std::sort(walk_.images.begin(), walk_.images.end());
    std::sort(walk_.videos.begin(), walk_.videos.end());
    SortVideos();
    for (const auto& [extension, files] : others_) {
      Ignore("other_files", "other files", "", extension, files);
    }
    return std::move(walk_);
  }

 private:
  // False where the folder has been read already: links may lead to one twice, or in a
  // circle.
  bool MarkRead(const fs::path& folder) {
    std::error_code error;
    const fs::path real = fs::canonical(folder, error);
    return read_.insert(error ? folder : real).second;
  }

  bool HoldsTop(const fs::path& folder) const {
    std::error_code error;
    const fs::path real = fs::canonical(folder, error), top = fs::canonical(top_, error);
    return std::mismatch(real.begin(), real.end(), top.begin(), top.end()).first == real.end();
  }

  // Links are followed after all else and in the order of their names, so that what they are read
  // as does not depend on how a folder is listed.
  void FollowFirstLink() {
    const std::string name = *links_.begin();
    links_.erase(links_.begin());
    if (HoldsTop(top_ / name)) {
      walk_.skipped.push_back({PrintableName(name), "links to a folder that holds this one"});
    } else if (MarkRead(top_ / name)) {
      List(name);
    } else {
      walk_.skipped.push_back({PrintableName(name), "links to a folder that is read already"});
    }
  }

  void List(const std::string& below) {
    std::error_code error;
    fs::directory_iterator entries(below.empty() ? top_ : top_ / below, error);
    for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
      const std::string part = entries->path().filename().string();
      const std::string name = below.empty() ? part : below + "/" + part;
      std::error_code ignored;
      if (entries->is_directory(ignored)) {
        AddFolder(entries->path(), part, name);
      } else {
        AddFile(entries->path(), part, name);
      }
    }
    if (!error) return;
    const std::string reason = "cannot be listed: " + error.message();
    if (below.empty()) throw Error(top_.string() + ": " + reason);
    walk_.skipped.push_back({PrintableName(below), reason});
  }

  void AddFolder(const fs::path& path, const std::string& part, const std::string& name) {
    if (part.front() == '.' || IsSystemFolder(part)) {
      const int files = FilesBelow(path);
      if (files > 0) {
        Ignore("system_files", "system files", "hidden files, thumbnails",
               PrintableName(part) + "/", files);
      }
      return;
    }
    if (!recurse_) return;
    std::error_code ignored;
    if (IsOwnFolder(path)) {
      Ignore("own_folders", "files of folders that dtr made", "", PrintableName(name) + "/",
             FilesBelow(path));
    } else if (fs::is_symlink(path, ignored)) {
      links_.insert(name);
    } else if (MarkRead(path)) {
      List(name);
    } else {
      walk_.skipped.push_back({PrintableName(name), "is read already, by a link to it"});
    }
  }

  void AddFile(const fs::path& path, const std::string& part, const std::string& name) {
    const std::string extension = LowerCase(path.extension().string());
    if (part.front() == '.' || IsSystemFile(part)) {
      Ignore("system_files", "system files", "hidden files, thumbnails",
             part.rfind("._", 0) == 0 ? "._*" : PrintableName(part), 1);
    } else if (IsVideoExtension(extension)) {
      walk_.videos.push_back(name);
    } else if (!IsImageExtension(extension)) {
      AddOther(path, extension);
    } else if (!IsUtf8(name) || std::any_of(name.begin(), name.end(), IsControl)) {
      walk_.skipped.push_back({PrintableName(name), "its name is no printable UTF-8; rename it"});
    } else if (!WhyUnsafeName(name).empty()) {
      walk_.skipped.push_back(
          {PrintableName(name), "its name " + WhyUnsafeName(name) + "; rename it"});
    } else if (name.front() == ' ') {
      walk_.skipped.push_back(
          {name, "its name begins with a blank, which COLMAP's files cannot hold; rename it"});
    } else {
      walk_.images.push_back(name);
    }
  }

  // What the name does not call an image may be one by its content.
  void AddOther(const fs::path& path, const std::string& extension) {
    static constexpr std::array<std::string_view, 8> kUnread{".jxl",  ".jxr", ".hdp", ".avci",
                                                             ".avcs", ".wdp", ".bpg", ".xcf"};
    const std::string shown = extension.empty() ? "no extension" : PrintableName(extension);
    if (IsOneOf(extension, kUnread)) {
      Ignore("unread_images", "images of formats that are not read", "convert them to PNG or JPEG",
             shown);
    } else if (io::HoldsPhoto(path)) {
      Ignore("unnamed_images", "files with an image inside but no image extension",
             "rename them to use them", shown);
    } else {
      ++others_[shown];
    }
  }

  // A phone's live photo is a still with a film of the same name.
  void SortVideos() {
    std::set<std::string> stems;
    for (const std::string& image : walk_.images) stems.insert(StemOf(image));
    const auto is_proxy = [](const std::string& video) {
      return IsProxyVideoExtension(fs::path(video).extension().string());
    };
    const bool proxies_alone = std::all_of(walk_.videos.begin(), walk_.videos.end(), is_proxy);
    for (const std::string& video : walk_.videos) {
      const std::string shown = PrintableName(LowerCase(fs::path(video).extension().string()));
      if (stems.contains(StemOf(video))) {
        Ignore("live_photo_videos", "videos of live photos", "the photo beside each is used",
               shown);
      } else if (is_proxy(video) && !proxies_alone) {
        Ignore("proxy_videos", "videos of low resolution", "use those of full resolution", shown);
      } else {
        Ignore("videos", "videos", "give a video by itself to use its frames", shown);
      }
    }
    walk_.contents.videos = static_cast<int>(walk_.videos.size());
  }

  void Ignore(const std::string& kind, const std::string& what, const std::string& reason,
              const std::string& where, int files = 1) {
    walk_.contents.Ignore(kind, what, reason, where, files);
  }

  const fs::path& top_;
  bool recurse_;
  FolderWalk walk_;
  std::map<std::string, int> others_;
  std::set<std::string> links_;  // to folders, by name, still to be followed
  std::set<fs::path> read_;      // folders, without links in their paths
};

}  // namespace

FolderWalk WalkFolder(const fs::path& folder, bool recurse) {
  return Walker(folder, recurse).Finish();
}

}  // namespace dtr::capture
