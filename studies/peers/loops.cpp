// Scoring a hypothesis as one would write it down in C++: what the product's own loops are held against.
//
//   c++ -O3 -march=native -std=c++17 loops.cpp -o loops && ./loops FOLDER
//
// reads names of stages, one a line, and answers each with a line of JSON, as `studies peers` does.
//   plain_1  each point falls on its nearest pixel, whatever lies before it: no depth test
//   depth_1  the nearest point of a pixel is seen: one buffer of depths, cleared for each hypothesis
//   depth_3  the same, each point a square of 3 x 3 pixels
// Each hypothesis gets both costs: mutual information of 16 x 16 bins, and the mean of the lesser half of
// the squared differences. Grey values are whole numbers here, so that the median is one of 256 counts.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

template <class T>
static std::vector<T> numbers(const std::string &path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) {
        std::fprintf(stderr, "error: %s is not there\n", path.c_str());
        std::exit(2);
    }
    std::vector<T> values(static_cast<size_t>(file.tellg()) / sizeof(T));
    file.seekg(0);
    file.read(reinterpret_cast<char *>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
    return values;
}

static double processor_time() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct Costs {
    double information = 0, error = 0;
    int covered = 0;
};

struct Counts {
    uint32_t joint[256] = {}, difference[256] = {};
    int covered = 0;

    void add(int query, int shown) {
        joint[(query >> 4) * 16 + (shown >> 4)]++;
        difference[std::abs(query - shown)]++;
        covered++;
    }

    Costs costs() const {
        if (covered == 0) return {};
        double rows[16] = {}, columns[16] = {}, together = 0;
        for (int i = 0; i < 256; i++) {
            const double count = joint[i];
            rows[i / 16] += count;
            columns[i % 16] += count;
            if (count > 0) together += count * std::log(count);
        }
        const auto sum = [](const double *counts) {
            double sum = 0;
            for (int i = 0; i < 16; i++)
                if (counts[i] > 0) sum += counts[i] * std::log(counts[i]);
            return sum;
        };
        const double all = std::log(covered);
        const double query = all - sum(rows) / covered, shown = all - sum(columns) / covered;
        const double larger = std::max(query, shown);
        const double shared = query + shown - (all - together / covered);
        double squares = 0, counted = 0;
        for (int d = 0, before = 0; d < 256; d++) {
            squares += static_cast<double>(difference[d]) * d * d;
            counted += difference[d];
            before += static_cast<int>(difference[d]);
            if (before > (covered - 1) / 2) break;
        }
        return {larger > 0 ? 1 - shared / larger : 1, squares / counted, covered};
    }
};

struct Scene {
    int width, height;
    float fx, fy, cx, cy;
    std::vector<uint8_t> query, values;
    std::vector<float> points;
    std::vector<double> poses;
    std::vector<float> depths;
    std::vector<uint8_t> shown;

    template <class Put>
    void project(const double *pose, Put put) const {
        float m[12];
        std::copy(pose, pose + 12, m);
        for (size_t i = 0; i < values.size(); i++) {
            const float *p = &points[3 * i];
            const float z = m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11];
            if (!(z > 0.1f)) continue;
            const float near = 1 / z;
            const float u = fx * (m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3]) * near + cx + 0.5f;
            const float v = fy * (m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7]) * near + cy + 0.5f;
            if (u >= 0 && v >= 0 && u < width && v < height) put(static_cast<int>(u), static_cast<int>(v), z, values[i]);
        }
    }

    Costs plain(const double *pose) const {
        Counts counts;
        project(pose, [&](int u, int v, float, int value) { counts.add(query[v * width + u], value); });
        return counts.costs();
    }

    Costs with_depths(const double *pose, int reach) {
        std::fill(depths.begin(), depths.end(), INFINITY);
        project(pose, [&](int u, int v, float z, int value) {
            for (int y = std::max(0, v - reach); y <= std::min(height - 1, v + reach); y++)
                for (int x = std::max(0, u - reach); x <= std::min(width - 1, u + reach); x++)
                    if (z < depths[y * width + x]) {
                        depths[y * width + x] = z;
                        shown[y * width + x] = static_cast<uint8_t>(value);
                    }
        });
        Counts counts;
        for (size_t i = 0; i < depths.size(); i++)
            if (depths[i] < INFINITY) counts.add(query[i], shown[i]);
        return counts.costs();
    }
};

int main(int count, char **arguments) {
    if (count != 8) {
        std::fprintf(stderr, "error: FOLDER WIDTH HEIGHT FX FY CX CY expected\n");
        return 2;
    }
    const std::string folder = arguments[1];
    Scene scene;
    scene.width = std::stoi(arguments[2]);
    scene.height = std::stoi(arguments[3]);
    float *camera[] = {&scene.fx, &scene.fy, &scene.cx, &scene.cy};
    for (int i = 0; i < 4; i++) *camera[i] = std::stof(arguments[4 + i]);
    const auto whole = [](const std::vector<float> &values) {
        std::vector<uint8_t> whole(values.size());
        std::transform(values.begin(), values.end(), whole.begin(), [](float v) { return static_cast<uint8_t>(v); });
        return whole;
    };
    scene.query = whole(numbers<float>(folder + "/query_channel.f32"));
    scene.values = whole(numbers<float>(folder + "/values.f32"));
    scene.points = numbers<float>(folder + "/points.f32");
    scene.poses = numbers<double>(folder + "/poses.f64");
    scene.depths.resize(scene.query.size());
    scene.shown.resize(scene.query.size());
    const size_t poses = scene.poses.size() / 12;
    for (std::string stage; std::getline(std::cin, stage);) {
        long covered = 0;
        size_t best = 0;
        double least = INFINITY;
        const double begun = processor_time();
        for (size_t i = 0; i < poses; i++) {
            const double *pose = &scene.poses[12 * i];
            const Costs costs = stage == "plain_1"   ? scene.plain(pose)
                                : stage == "depth_1" ? scene.with_depths(pose, 0)
                                                     : scene.with_depths(pose, 1);
            covered += costs.covered;
            if (costs.information + 1e-9 * costs.error < least) {
                least = costs.information;
                best = i;
            }
        }
        const double seconds = processor_time() - begun;
        std::printf("{\"seconds\": %.9f, \"items\": %zu, \"outcome\": {\"covered\": %ld, \"best\": %zu}}\n", seconds, poses, covered, best);
        std::fflush(stdout);
    }
}
