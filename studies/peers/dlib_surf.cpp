// SURF of dlib, where its headers are installed (Debian: libdlib-dev, libblas-dev).
//
//   c++ -O3 -march=native -DNDEBUG -std=c++17 dlib_surf.cpp -ldlib -lblas -o dlib_surf && ./dlib_surf FILE WIDTH HEIGHT THRESHOLD
//
// answers each line of its input with a line of JSON, as `studies peers` does.
#include <dlib/array2d.h>
#include <dlib/image_keypoint.h>

#include <cstdio>
#include <ctime>
#include <fstream>
#include <iostream>
#include <string>

static double processor_time() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

int main(int count, char **arguments) {
    if (count != 5) {
        std::fprintf(stderr, "error: FILE WIDTH HEIGHT THRESHOLD expected\n");
        return 2;
    }
    const long width = std::stol(arguments[2]), height = std::stol(arguments[3]);
    const double threshold = std::stod(arguments[4]);
    dlib::array2d<unsigned char> image(height, width);
    std::ifstream file(arguments[1], std::ios::binary);
    for (long row = 0; row < height; row++) file.read(reinterpret_cast<char *>(&image[row][0]), width);
    for (std::string line; std::getline(std::cin, line);) {
        const double begun = processor_time();
        const auto points = dlib::get_surf_points(image, 1000000, threshold);
        const double seconds = processor_time() - begun;
        std::printf("{\"seconds\": %.9f, \"items\": %zu, \"outcome\": null}\n", seconds, points.size());
        std::fflush(stdout);
    }
}
