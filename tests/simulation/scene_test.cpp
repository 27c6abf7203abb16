/// Reading good scenes, and the documentation of the format.

#include "hybmss/simulation/scene.hpp"
#include "tests/program.hpp"

#include <string>

namespace hybmss {
namespace {

TEST(Scene, integers_serve_as_numbers_and_defaults_hold) {
    const Scene scene = parse_scene("[body]\ncells = [1, 2, 3]\ncell_size = 2\n"
                                    "[material]\nyoung_modulus = 10\npoisson_ratio = 0\ndensity = 7\n"
                                    "[solver]\nduration = 4\n",
                                    "s.toml");
    EXPECT_EQ(scene.body.cells[2], 3);
    EXPECT_EQ(scene.body.cell_size, 2.0);
    EXPECT_EQ(scene.material.young_modulus, 10.0);
    EXPECT_EQ(scene.material.face_diagonal_ratio, 1.0);
    EXPECT_EQ(scene.material.volume_energy, VolumeEnergy::automatic);
    EXPECT_FALSE(scene.solver.tolerance || scene.solver.time_step || scene.output.every);
    EXPECT_EQ(scene.damping.mass, 0.0);
}

TEST(Scene, every_region_and_motion_is_read) {
    const Scene scene =
        parse_scene(test::small_scene("[[fix]]", "[[fix]]\nwhere = {node = 4}\naxes = \"zx\"\n"
                                                 "[[fix]]\nwhere = {sphere = {center = [1, 2, 3], radius = 0.5}}\n"
                                                 "[[move]]\nwhere = {box = [[0, 0, 0], [1, 2, 3]]}\n"
                                                 "rotate = {axis = \"z\", degrees = -30}\nover = 0\n[[fix]]"),
                    "s.toml");
    ASSERT_EQ(scene.fixes.size(), 3u);
    EXPECT_EQ(std::get<NodeRegion>(scene.fixes[0].where).node, 4);
    EXPECT_EQ(scene.fixes[0].axes, 5);
    EXPECT_EQ(std::get<SphereRegion>(scene.fixes[1].where).center[2], 3.0);
    EXPECT_EQ(std::get<FaceRegion>(scene.fixes[2].where).axis, 1);
    EXPECT_FALSE(std::get<FaceRegion>(scene.fixes[2].where).high);
    ASSERT_EQ(scene.moves.size(), 2u);
    EXPECT_EQ(std::get<BoxRegion>(scene.moves[0].where).high[1], 2.0);
    EXPECT_EQ(std::get<Rotation>(scene.moves[0].motion).axis, 2);
    EXPECT_EQ(std::get<Rotation>(scene.moves[0].motion).degrees, -30.0);
    EXPECT_EQ(scene.moves[1].axes, kAllAxes);
}

TEST(Scene, documentation_shows_exactly_the_keys_of_the_parser) {
    const std::string document = test::read_text(HYBMSS_SOURCE_DIR "/docs/report/scene_keys.md");
    EXPECT_NE(document.find(scene_keys_markdown()), std::string::npos)
        << "docs/report/scene_keys.md must hold what `hybmss explain --keys` prints";
    EXPECT_GT(scene_keys().size(), 25u);
}

/// The example at the head of docs/scenes.md, which is indented by four blanks.
TEST(Scene, documentation_example_is_a_scene) {
    const std::string document = test::read_text(HYBMSS_SOURCE_DIR "/docs/scenes.md");
    std::string text;
    for (std::size_t at = document.find("    [body]"); document.compare(at, 3, "Run") != 0;) {
        const std::size_t end = document.find('\n', at);
        text += document.substr(at, end + 1 - at);
        at = end + 1;
    }
    EXPECT_EQ(parse_scene(text, "docs/scenes.md").probes.at(0).name, "plate");
}

} // namespace
} // namespace hybmss
