// dtr/base/hash.h -- content hashes of files and buffers.
#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace dtr {

/// SHA-256 of a buffer, 64 lower-case hexadecimal digits.
std::string Sha256(std::span<const std::byte> data);

/// SHA-256 of a file's content, read in pieces. Throws Error when it cannot be read.
std::string Sha256OfFile(const std::filesystem::path& file);

}  // namespace dtr
