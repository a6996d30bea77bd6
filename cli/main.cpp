// The `dtr` program.
#include "cli/program.h"

int main(int argc, char** argv) { return dtr::cli::RunProgram(argc, argv); }
