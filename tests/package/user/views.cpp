#include <dtr/io/set_io.h>
#include <iostream>
int main(int, char** argv) {
  for (const auto& view : dtr::io::LoadSet(argv[1]).frames[0].views) std::cout << view.name << '\n';
}
