// cli/program.h -- the whole `dtr` program.
#pragma once

namespace dtr::cli {

/// Parses, calls one function, prints; gives main()'s exit code.
int RunProgram(int argc, char** argv);

}  // namespace dtr::cli
