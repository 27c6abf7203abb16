// A scene's file is read and run to its end.

#include "hybmss/simulation/scene.hpp"
#include "hybmss/simulation/simulation.hpp"

#include <cstdio>
#include <exception>

int main(int count, char** arguments) {
    if (count != 2) {
        return 2;
    }
    try {
        const hybmss::Summary summary = hybmss::Simulation(hybmss::load_scene(arguments[1])).run();
        std::puts(summary.failure.c_str());
        return summary.converged ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
