#include "pipeline/export/detail/file_in_work.h"

#include "dtr/base/files.h"

namespace dtr::pipeline {

FileInWork::FileInWork(const std::filesystem::path& target)
    : target_(target), work_(WorkFolder::Of(target), "export") {}

void FileInWork::Publish() { PublishFile(path(), target_); }

}  // namespace dtr::pipeline
