// One side of an exchange over preCICE: `exchange_precice CONFIG mpm|dem POINTS WINDOWS BEHIND`.
//
// In every time window the points' side writes position and velocity of each point, as Tandem's ImpState, and the bodies' side
// writes a force and a stiffness for each, as Tandem's ImpForce. The bodies' side has direct access to the points' mesh: nothing
// is mapped. In every sixteenth window both sides compare all numbers that arrive with those that were written, BEHIND windows
// before on the bodies' side (0: serial, 1: parallel). Each side prints the wall and CPU time, and that of the numbers alone.
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include <precice/precice.hpp>

static const int WARM = 256, CHECKED = 16;

static double cpu() {
    rusage used;
    getrusage(RUSAGE_SELF, &used);
    return used.ru_utime.tv_sec + used.ru_stime.tv_sec + 1e-6 * (used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

// What is written for component k of all points in a window; 0 before the first, as preCICE's data begin.
static double number(int window, std::size_t k) { return window < 1 ? 0.0 : window + 1e-3 * double(k); }

static void fill(std::vector<double>& data, int window, double sign) {
    for (std::size_t k = 0; k < data.size(); ++k) data[k] = sign * number(window, k);
}

static long wrong(const std::vector<double>& data, int window, double sign) {
    long count = 0;
    if (window % CHECKED != 0) return 0;
    for (std::size_t k = 0; k < data.size(); ++k) count += data[k] != sign * number(window, k);
    return count;
}

int main(int count, char** words) {
    if (count != 6) return std::fprintf(stderr, "usage: exchange_precice CONFIG mpm|dem POINTS WINDOWS BEHIND\n"), 2;
    const std::string side = words[2];
    const bool leads = side == "mpm";
    const std::size_t points = std::atol(words[3]);
    const int windows = std::atoi(words[4]), behind = std::atoi(words[5]);
    precice::Participant party(side, words[1], 0, 1);
    std::vector<precice::VertexID> ids(points);
    if (leads) {
        std::vector<double> places(2 * points, 0.0);
        for (std::size_t i = 0; i < points; ++i) places[2 * i] = 0.1 + 0.05 * double(i);
        party.setMeshVertices("points", places, ids);
    } else {
        const double far = 1e9;
        party.setMeshAccessRegion("points", std::vector<double>{-far, far, -far, far});
    }
    party.initialize();
    if (!leads) {
        std::vector<double> places(2 * points);
        party.getMeshVertexIDsAndCoordinates("points", ids, places);
    }
    std::vector<double> position(2 * points), velocity(2 * points), force(2 * points), stiffness(points);
    const auto clock = [] { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); };
    double began = 0.0, used = 0.0, numbers = 0.0;
    long faults = 0;
    for (int window = 1; party.isCouplingOngoing(); ++window) {
        if (window == WARM + 1) began = clock(), used = cpu(), numbers = 0.0;
        const double dt = party.getMaxTimeStepSize();
        if (leads) {
            party.readData("points", "Force", ids, dt, force);
            party.readData("points", "Stiffness", ids, dt, stiffness);
            const double start = clock();
            faults += wrong(force, window - 1, -1.0) + wrong(stiffness, window - 1, 1.0);
            fill(position, window, 1.0);
            fill(velocity, window, -1.0);
            numbers += clock() - start;
            party.writeData("points", "Position", ids, position);
            party.writeData("points", "Velocity", ids, velocity);
        } else {
            party.readData("points", "Position", ids, dt, position);
            party.readData("points", "Velocity", ids, dt, velocity);
            const double start = clock();
            faults += wrong(position, window - behind, 1.0) + wrong(velocity, window - behind, -1.0);
            fill(force, window, -1.0);
            fill(stiffness, window, 1.0);
            numbers += clock() - start;
            party.writeData("points", "Force", ids, force);
            party.writeData("points", "Stiffness", ids, stiffness);
        }
        party.advance(dt);
    }
    std::printf("{\"items\": %zu, \"steps\": %d, \"wall\": %.9f, \"cpu\": %.6f, \"numbers\": %.6f, \"wrong\": %ld}\n", points, windows,
                clock() - began, cpu() - used, numbers, faults);
    party.finalize();
    return faults != 0;
}
