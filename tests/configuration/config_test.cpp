// Configurations: reading, errors for invalid configurations, and writing.
#include "pictura/configuration/config.h"

#include <filesystem>

#include <gmock/gmock.h>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/configuration/compare_configs.h"
#include "pictura/configuration/config_keys.h"
#include "pictura/policy/torch_device.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/training/training_maps.h"

namespace pictura {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string error_in(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return test::message_of([&] { parse_config(text, "a.toml", overrides); });
}

TEST(Config, DefaultsAreThePapersTables) {
  const Config c = parse_config("", "a.toml");
  EXPECT_EQ(c.simulator.num_slots, 20 * 1024);
  EXPECT_EQ(c.train.num_steps * int64_t{c.simulator.num_slots}, 2621440);
  EXPECT_EQ(c.train.minibatch_size, 65536);
  EXPECT_EQ(c.train.gamma, 0.999);
  EXPECT_EQ(c.train.learning_rate, 5e-4);
  EXPECT_EQ(c.simulator.conditioning[static_cast<size_t>(Conditioning::collision)].high, 3.0f);
  EXPECT_TRUE(c.simulator.conditioning[static_cast<size_t>(Conditioning::acceleration)].mixture);
}

TEST(Config, PaperFileEqualsTheDefaults) {
  const Config paper = load_config(PICTURA_SOURCE_DIR "/configs/paper.toml");
  EXPECT_EQ(first_difference(Config{}, paper), "");
  EXPECT_EQ(to_toml(paper), to_toml(Config{}));
}

// Rows are "| `key` | default | values | meaning |"; the first three come from the list of keys.
TEST(Config, TheReferenceListsExactlyTheKeysDefaultsAndRanges) {
  const std::string document = read_file(PICTURA_SOURCE_DIR "/docs/reference/configuration.md");
  size_t rows = 0;
  for (const ConfigKey& key : config_keys()) {
    EXPECT_THAT(document, HasSubstr(fmt::format("\n| `{}` | `{}` | {} | ", key.key, key.default_value, key.values)));
    ++rows;
  }
  size_t written = 0;
  for (size_t at = document.find("\n| `"); at != std::string::npos; at = document.find("\n| `", at + 1)) ++written;
  EXPECT_EQ(written, rows) << "docs/reference/configuration.md has rows of keys that no configuration has";
}

TEST(Config, NumbersMayBeWrittenInAnyDecimalNotation) {
  const auto updates = [](const std::string& text) {
    return parse_config("", "a.toml", {"train.updates=" + text}).train.updates;
  };
  EXPECT_EQ(updates("1e3"), 1000);
  EXPECT_EQ(updates("010"), 10);
  EXPECT_EQ(updates("2000.0"), 2000);
  EXPECT_EQ(parse_config("[train]\nupdates = 1e3\n", "a.toml").train.updates, 1000);
  EXPECT_EQ(parse_config("", "a.toml", {"train.gamma=.5"}).train.gamma, 0.5);
  for (const std::string text : {"1.5", "0x10", "1_000", "-1", "1e30", "18446744073709551616"}) {
    EXPECT_THAT(error_in("", {"train.updates=" + text}),
                StartsWith("--set train.updates: expected an integer in [1, 1099511627776], got "));
  }
}

TEST(Config, RecordedScenesHaveTheirOwnSettings) {
  const auto config_of = [](const std::string& maps, const std::vector<std::string>& more = {}) {
    std::vector<std::string> overrides = more;
    overrides.push_back("simulator.maps=[" + maps + "]");
    return parse_config("", "scenes.toml", overrides);
  };
  const Config config = config_of(R"("scenes:a", "scenes:b#3")",
                                  {"simulator.scenes.control=self", R"(simulator.scenes.rules=["box_scale=1"])"});
  ASSERT_TRUE(config.simulator.has_scenes());
  EXPECT_FALSE(Config().simulator.has_scenes());
  const SceneProtocol protocol = config.simulator.scenes.training_protocol();
  EXPECT_EQ(protocol.name, "gpudrive");
  EXPECT_EQ(protocol.control, "self");
  EXPECT_EQ(protocol.box_scale, 1);
  EXPECT_EQ(scene_source("scenes:a"), "a");
  EXPECT_EQ(scene_source("Town01"), std::nullopt);
  EXPECT_TRUE(with_absolute_paths(config).simulator.maps[0].starts_with("scenes:/"));
  EXPECT_EQ(to_toml(parse_config(to_toml(config), "again")), to_toml(config));
  const auto refusal = [&](const std::string& maps, const std::vector<std::string>& more = {}) {
    return test::message_of<Error>([&] { config_of(maps, more); });
  };
  const std::string scenes = R"("scenes:a")";
  EXPECT_THAT(refusal(R"("scenes:a", "Town01")"), HasSubstr("simulator.maps: expected only recorded scenes"));
  EXPECT_THAT(refusal(R"("Town01", "scenes:a")"), HasSubstr("simulator.maps: expected either roads or recorded"));
  EXPECT_THAT(refusal(R"("scenes:")"), HasSubstr("each as scenes:NAME, got 'scenes:'"));
  EXPECT_THAT(refusal(scenes, {"simulator.map_copies=1"}), HasSubstr("simulator.map_copies: expected 0"));
  EXPECT_THAT(refusal(scenes, {"train.evaluate_every=1"}), HasSubstr("train.evaluate_every: expected 0"));
  EXPECT_THAT(refusal(scenes, {"simulator.scenes.protocol=wosac"}), HasSubstr("gpudrive"));
  EXPECT_THAT(refusal(scenes, {"simulator.scenes.control=cars"}), HasSubstr("got 'cars'"));
  EXPECT_THAT(refusal(scenes, {R"(simulator.scenes.rules=["late=drive"])"}),
              HasSubstr("simulator.scenes: rule late: expected replay or absent"));
}

TEST(Config, UnknownKeysSuggestTheNearest) {
  EXPECT_THAT(error_in("", {"train.updats=1"}), HasSubstr("did you mean 'train.updates'?"));
  EXPECT_THAT(error_in("", {"train.precision=bf61"}), HasSubstr("got 'bf61'; did you mean 'bf16'?"));
  EXPECT_EQ(error_in("", {"trian.updates=1"}), "--set trian.updates: unknown key; did you mean 'train.updates'?");
  EXPECT_THAT(error_in("", {"train.zebra=1"}), HasSubstr("docs/reference/configuration.md lists every key"));
}

TEST(Config, KeysCanBeUnsetAndARigReplacesTheSizesOfTheFile) {
  const std::string text = "[render]\nwidth_px = 32\nheight_px = 18\n[train]\nupdates = 5\n";
  EXPECT_EQ(parse_config(text, "a.toml", {"train.updates="}).train.updates, Config{}.train.updates);
  const Config with_rig = parse_config(text, "a.toml", {"render.rig=a.toml"});
  EXPECT_EQ(with_rig.render.rig, "a.toml");
  EXPECT_EQ(parse_config(text, "a.toml", {"render.rig="}).render.width_px, 32);
  EXPECT_THAT(error_in(text, {"render.rig=a.toml", "render.width_px=8"}), HasSubstr("has no effect together"));
}

TEST(Config, PathsAreRelativeToTheirFileOrWorkingFolder) {
  const test::ScratchFolder folder;
  const std::string path = folder / "a.toml";
  write_file(path, "[simulator]\nmaps = [\"towns/a.xodr\", \"Town01\"]\n[render]\nrig = \"../rig.toml\"\n");
  const Config typed_there = load_config(path);
  EXPECT_EQ(typed_there.simulator.maps, (std::vector<std::string>{folder / "towns/a.xodr", "Town01"}));
  EXPECT_EQ(std::filesystem::path(typed_there.render.rig),
            (std::filesystem::path(folder.path()) / "../rig.toml").lexically_normal());
  const Config typed_here = load_config(path, {"simulator.maps=[\"b.xodr\"]", "render.rig=b.toml"});
  EXPECT_EQ(typed_here.simulator.maps, std::vector<std::string>{"b.xodr"});
  EXPECT_EQ(typed_here.render.rig, "b.toml");
  const Config anywhere = with_absolute_paths(typed_here);
  EXPECT_EQ(anywhere.render.rig, (std::filesystem::current_path() / "b.toml").string());
}

TEST(Config, SettingsWithoutEffectAreReported) {
  EXPECT_THAT(error_in("[simulator]\nnum_slots = 4\nmin_agents = 8\nmax_agents = 8\n"),
              HasSubstr("simulator.min_agents: expected at most simulator.num_slots (4), got 8"));
  Config config;
  EXPECT_EQ(settings_without_effect(config).size(), 0u);
  config.simulator.num_slots = 4;
  EXPECT_THAT(settings_without_effect(config), ElementsAre(HasSubstr("train.minibatch_size: 65536 are more than")));
}

TEST(Config, EveryFileInConfigsReads) {
  for (const char* name : {"smoke", "demo", "town01", "agent", "paper"}) {
    EXPECT_NO_THROW(load_config(fmt::format("{}/configs/{}.toml", PICTURA_SOURCE_DIR, name))) << name;
  }
}

TEST(Config, WrittenTextReadsBackEqual) {
  Config c;
  c.run.seed = 77;
  c.simulator.maps = {"a \"quoted\" name", "b"};
  c.simulator.conditioning[0] = {3.3f, 4.7f, false};
  c.train.learning_rate = 1.0 / 3.0;
  c.train.ent_coef = 0;
  c.simulator.pedestrian_fraction = 0;
  c.simulator.cyclist_fraction = 0.7f;
  c.policy.modality = Modality::perspective;
  c.render.schedule = {{800, 20, 12}, {900, 40, 24, 8, 0.7}};
  const Config back = parse_config(to_toml(c), "b.toml");
  EXPECT_EQ(to_toml(back), to_toml(c));
  EXPECT_THAT(to_toml(c), HasSubstr("pedestrian_fraction = 0.0\ncyclist_fraction = 0.7\n"));
  EXPECT_EQ(back.simulator.maps, c.simulator.maps);
  EXPECT_EQ(back.train.learning_rate, c.train.learning_rate);
  EXPECT_EQ(back.render.schedule.at(1).width_px, 40);
  EXPECT_FALSE(back.render.schedule.at(0).has_patches());
  EXPECT_EQ(back.render.schedule.at(1).patch_px, 8);
  EXPECT_EQ(back.render.schedule.at(1).line_floor_px, 0.7);
  EXPECT_EQ(back.simulator.conditioning[0].low, 3.3f);
}

TEST(Config, OverridesTakePrecedenceAndAcceptNewKeysAndBareWords) {
  const Config c = parse_config(
      "[train]\nupdates = 5\n", "a.toml",
      {"train.updates=2", "run.device=cpu", "simulator.conditioning.collision=[1, 2]", "simulator.maps=[\"Town01\"]"});
  EXPECT_EQ(c.train.updates, 2);
  EXPECT_EQ(c.run.device, "cpu");
  EXPECT_EQ(c.simulator.conditioning[static_cast<size_t>(Conditioning::collision)].low, 1.0f);
  EXPECT_EQ(c.simulator.maps.size(), 1u);
}

TEST(Config, ErrorsNameFileLineAndKey) {
  EXPECT_THAT(error_in("[train]\nupdates = 5\nlearning_rat = 1\n"),
              AllOf(HasSubstr("a.toml:3:"), HasSubstr("train.learning_rat")));
  EXPECT_THAT(error_in("[run]\ngamma = 0.9\n"), AllOf(HasSubstr("a.toml:2:"), HasSubstr("did you mean 'train.gamma'")));
  EXPECT_THAT(error_in("[simulator]\nnum_slots = 0\n"),
              AllOf(HasSubstr("a.toml:2: simulator.num_slots"), HasSubstr("got 0")));
  EXPECT_THAT(error_in("[simulator]\nnum_slots = 100000000\n"), HasSubstr("got 100000000"));
  EXPECT_THAT(error_in("[simulator]\nnum_slots = 1.5\n"), HasSubstr("expected an integer"));
  EXPECT_THAT(error_in("[render]\nwidth_px = 0\nheight_px = 0\n"), HasSubstr("render.width_px"));
  for (const char* bad :
       {"5", "[5]", "[[5, 6]]", "[[5, 6, 7], [5, 8, 9]]", "[[0, 6, 7]]", "[[5, 0, 7]]", "[[5, 192, 108, 8]]",
        "[[5, 192, 108, 17, 1]]", "[[5, 192, 108, 8, -1]]", "[[5, 192, 108, 8, 17]]", "[[5, 192, 108, 8, 1, 1]]"}) {
    EXPECT_THAT(error_in(fmt::format("[render]\nschedule = {}\n", bad)),
                AllOf(HasSubstr("a.toml:2: render.schedule"), HasSubstr("expected")));
  }
  EXPECT_THAT(error_in("[train]\ngamma = nan\n"), HasSubstr("train.gamma"));
  EXPECT_THAT(error_in("[train]\ngamma = \"a\"\n"), HasSubstr("expected a number"));
  EXPECT_THAT(error_in("[policy]\nmodality = \"sonar\"\n"), HasSubstr("perspective"));
  EXPECT_THAT(error_in("[policy]\nconv_strides = [1, 2]\n"), HasSubstr("policy.conv_strides"));
  EXPECT_THAT(error_in("[policy]\nattention_heads = 3\n"), HasSubstr("divisor"));
  EXPECT_THAT(error_in("[simulator.conditioning]\ncollision = [3, 1]\n"), HasSubstr("low <= high"));
  EXPECT_THAT(error_in("[simulator.conditioning]\nthrottle = [1.1, 1.2]\n"), HasSubstr("low <= 1 <= high"));
  EXPECT_THAT(error_in("[simulator.conditioning]\nthrottle = [0, 0]\n"), HasSubstr("low = high > 0"));
  EXPECT_EQ(error_in("[simulator.conditioning]\nthrottle = [0.9, 0.9]\n"), test::kNoError);
  EXPECT_THAT(error_in("[simulator]\nmin_agents = 9\nmax_agents = 8\n"), HasSubstr("a.toml:2: simulator.min_agents"));
  EXPECT_THAT(error_in("[train]\nupdates = \n"), HasSubstr("a.toml:2"));
  EXPECT_THAT(error_in("simulator = 5\n"), HasSubstr("a.toml:1"));
  EXPECT_THAT(error_in("", {"train.updates=0"}), AllOf(HasSubstr("--set train.updates"), HasSubstr("got 0")));
  EXPECT_THAT(error_in("", {"train.updates"}), HasSubstr("expected section.key=value"));
  EXPECT_THAT(error_in("", {"nonsense.key=1"}), HasSubstr("nonsense"));
}

// By default images are 96x54 in patches of 4.
TEST(Config, PatchesScaleWithImages) {
  const auto error_of = [](const std::string& schedule, const std::string& more = "") {
    return error_in(fmt::format("[render]\nschedule = {}\n{}", schedule, more));
  };
  for (const char* good : {"[[5, 192, 108, 8, 0.7]]", "[[5, 192, 108, 8, 0.7], [9, 384, 216, 16, 1.4]]",
                           "[[5, 64, 36, 4, 0.35], [6, 192, 108, 12, 1.05]]"}) {
    EXPECT_EQ(error_of(good), test::kNoError) << good;
  }
  for (const char* bad : {"[[5, 192, 108, 6, 1]]", "[[5, 144, 81, 6, 1]]", "[[5, 192, 54, 8, 1]]",
                          "[[5, 96, 54, 8, 1]]", "[[5, 48, 27, 2, 1]]"}) {
    EXPECT_THAT(error_of(bad), AllOf(HasSubstr("a.toml:2: render.schedule: from 5 agent-steps on"),
                                     HasSubstr("the same integer multiple of 96x54 in patches of 4, got")))
        << bad;
  }
  EXPECT_THAT(error_of("[[5, 64, 36], [6, 192, 108, 8, 1]]"), HasSubstr("64x36 in patches of 4, got 192x108"));
  EXPECT_THAT(error_of("[[5, 192, 108, 8, 1]]", "[policy]\nbackbone = \"vit.pt\"\n"), HasSubstr("policy.backbone"));
}

TEST(Config, TheScheduleGivesTheCurrentImageSettings) {
  Config c;
  c.render.schedule = {{10, 192, 108, 8, 0.7}, {20, 64, 36}};
  const auto images_at = [&c](int64_t agent_steps) {
    const Config at = config_at(c, agent_steps);
    const Camera camera = rig_of(c, agent_steps).cameras[0];
    EXPECT_EQ(at.render.width_px, camera.width_px);
    return fmt::format("{}x{} {} {}", camera.width_px, at.render.height_px, at.policy.patch_px,
                       at.render.line_floor_px);
  };
  EXPECT_EQ(images_at(9), "96x54 4 0.35");
  EXPECT_EQ(images_at(10), "192x108 8 0.7");
  EXPECT_EQ(images_at(20), "64x36 8 0.7");
  // Saved configurations can be read, even if their rows no longer lead to their sizes.
  EXPECT_EQ(to_toml(parse_saved_config(to_toml(config_at(c, 20)), "s.toml")), to_toml(config_at(c, 20)));
  EXPECT_EQ(first_difference(config_at(c, 9), config_at(c, 10)), "render.line_floor_px: 0.35 became 0.7");
  EXPECT_EQ(whole_factor({32, 18}, {96, 54}), 3);
  EXPECT_EQ(whole_factor({32, 18}, {96, 36}), 0);
  EXPECT_EQ(whole_factor({32, 18}, {16, 9}), 0);
}

TEST(Config, KeysWithoutEffectAreRefused) {
  EXPECT_THAT(error_in("[policy]\nmodality = \"perspective\"\nauxiliary = true\n"),
              AllOf(HasSubstr("a.toml:3: policy.auxiliary"), HasSubstr("no effect")));
  EXPECT_EQ(error_in("[policy]\nmodality = \"vector\"\nauxiliary = true\n"), test::kNoError);
  EXPECT_THAT(error_in("[policy]\nsegment_features = true\n"),
              AllOf(HasSubstr("a.toml:2: policy.segment_features"), HasSubstr("no effect")));
  EXPECT_EQ(error_in("[policy]\nmodality = \"vector\"\nsegment_features = true\n"), test::kNoError);
  EXPECT_THAT(error_in("[simulator]\nwall_observations = true\n"),
              AllOf(HasSubstr("a.toml:2: simulator.wall_observations"), HasSubstr("no effect")));
  EXPECT_THAT(error_in("[render]\nwidth_px = 96\nrig = \"r.toml\"\n"),
              AllOf(HasSubstr("a.toml:2: render.width_px"), HasSubstr("render.rig")));
  EXPECT_THAT(error_in("[render]\nrig = \"r.toml\"\nschedule = [[5, 6, 7]]\n"),
              AllOf(HasSubstr("a.toml:3: render.schedule"), HasSubstr("render.rig")));
  EXPECT_THAT(error_in("[render]\nschedule = [[5, 6, 7]]\n[policy]\nmodality = \"vector\"\n"),
              AllOf(HasSubstr("a.toml:2: render.schedule"), HasSubstr("vector")));
  EXPECT_THAT(error_in("[render]\nrig = \"r.toml\"\n", {"render.height_px=9"}),
              AllOf(HasSubstr("--set render.height_px"), HasSubstr("render.rig")));
  EXPECT_THAT(error_in("[train]\nhalted_slots = \"draw\"\n"),
              AllOf(HasSubstr("a.toml:2: train.halted_slots"), HasSubstr("train.adv_filter_threshold = 0, got 0.01")));
  EXPECT_EQ(error_in("[train]\nhalted_slots = \"draw\"\nadv_filter_threshold = 0\n"), test::kNoError);
  EXPECT_THAT(error_in("[train]\nhalted_slots = \"draw\"\nadv_filter_threshold = 0\nadv_filter = \"quantile\"\n"),
              AllOf(HasSubstr("a.toml:2: train.halted_slots"), HasSubstr("train.adv_filter = \"maximum\"")));
  // A configuration written for a run with a rig file can be read again.
  const Config c = parse_config("[render]\nrig = \"r.toml\"\n", "a.toml");
  EXPECT_EQ(to_toml(parse_config(to_toml(c), "b.toml")), to_toml(c));
}

TEST(Config, RemovedKeysAcceptOnlyTheirFixedValue) {
  const std::string kept =
      "[simulator.dynamics]\nforbid_reversing = false\n[policy]\ngoal_features = false\ncritic_layers = 0\nvalue_head "
      "= 'linear'\n";
  EXPECT_EQ(to_toml(parse_config(kept, "a.toml")), to_toml(Config{}));
  EXPECT_EQ(to_toml(parse_saved_config(kept, "a.ckpt")), to_toml(Config{}));
  EXPECT_EQ(error_in("[policy]\nvalue_head = 'two_hot'\n"),
            "a.toml:2: policy.value_head: expected \"linear\", got \"two_hot\": other heads were removed: "
            "docs/research/experiments.md");
  EXPECT_THAT(error_in("[policy]\nmodality = \"vector\"\ngoal_features = true\n"),
              HasSubstr("a.toml:3: policy.goal_features: expected false, got true: distances to goals were removed"));
  EXPECT_THAT(error_in("", {"policy.critic_layers=2"}),
              HasSubstr("--set policy.critic_layers: expected 0, got 2: separate trunks of the critic were removed"));
  EXPECT_THAT(
      error_in("[simulator.dynamics]\nforbid_reversing = true\n"),
      HasSubstr("a.toml:2: simulator.dynamics.forbid_reversing: expected false, got true: the rule was removed"));
}

TEST(Config, BackendsAreCheckedWhenAFileIsRead) {
  const std::string text = "[run]\ndevice = \"cuda:1\"\n[simulator]\nbackend = \"cpu\"\n[render]\nbackend = \"null\"\n";
  const Config c = parse_config(text, "a.toml");
  EXPECT_EQ(c.run.device, "cuda:1");
  EXPECT_EQ(c.simulator.backend, "cpu");
  EXPECT_EQ(c.render.backend, "null");
  EXPECT_EQ(to_toml(parse_config(to_toml(c), "b.toml")), to_toml(c));
  EXPECT_THAT(error_in("[run]\ndevice = \"gpu\"\n"),
              AllOf(HasSubstr("a.toml:2: run.device"), HasSubstr("cpu, cuda, cuda:N, auto"), HasSubstr("got 'gpu'")));
  EXPECT_THAT(error_in("[run]\ndevice = \"cuda:\"\n"), HasSubstr("got 'cuda:'"));
  EXPECT_THAT(error_in("[simulator]\nbackend = \"null\"\n"),
              AllOf(HasSubstr("simulator.backend: expected one of cpu, "), HasSubstr("got 'null'")));
  EXPECT_THAT(error_in("[render]\nbackend = \"vulkan\"\n"),
              AllOf(HasSubstr("render.backend: expected one of cpu, "), HasSubstr("got 'vulkan'")));
  // A run saved by another build can be read, whatever its renderer.
  EXPECT_EQ(parse_saved_config("[render]\nbackend = \"vulkan\"\n", "a.ckpt").render.backend, "vulkan");
}

TEST(Config, SamplesAreNumbersOrGridsForGlOnly) {
  const std::vector<std::string> gl{"render.backend=gl"};
  auto samples_of = [&](const std::string& value) {
    return parse_saved_config("[render]\nbackend = \"gl\"\nsamples = " + value + "\n", "a.toml").render.samples;
  };
  EXPECT_EQ(samples_of("4"), (PixelSamples{.grid = 1, .multisample = 4}));
  EXPECT_EQ(samples_of("\"4x4\""), (PixelSamples{.grid = 4, .multisample = 1}));
  EXPECT_THAT(error_in("[render]\nsamples = \"4x3\"\n"),
              AllOf(HasSubstr("a.toml:2: render.samples"), HasSubstr("4x3")));
  EXPECT_THAT(error_in("[render]\nsamples = 65\n"), HasSubstr("got 65"));
  EXPECT_THAT(error_in("[render]\nbackend = \"cpu\"\nsamples = 4\n"),
              AllOf(HasSubstr("a.toml:3: render.samples"), HasSubstr("only gl")));
}

TEST(Config, TheOldBackendKeyIsTheDefaultOfNewKeys) {
  auto backends = [](const std::string& text) {
    const Config c = parse_saved_config(text, "a.toml");
    return c.simulator.backend + " " + c.render.backend;
  };
  EXPECT_EQ(backends("[run]\nbackend = \"cuda\"\n"), "cuda cuda");
  EXPECT_EQ(backends("[run]\nbackend = \"auto\"\n"), "auto auto");
  EXPECT_EQ(backends("[run]\nbackend = \"null\"\n"), "cpu null");
  EXPECT_EQ(backends("[run]\nbackend = \"null\"\n[render]\nbackend = \"cpu\"\n"), "cpu cpu");
  EXPECT_EQ(backends("[run]\nbackend = \"cpu\"\n[simulator]\nbackend = \"auto\"\n"), "auto cpu");
  EXPECT_THAT(error_in("[run]\nbackend = \"vulkan\"\n"),
              AllOf(HasSubstr("a.toml:2: run.backend"), HasSubstr("vulkan")));
  EXPECT_THAT(error_in("[run]\nbackend = \"cpu\"\n", {"simulator.backend=cpu", "render.backend=null"}),
              AllOf(HasSubstr("a.toml:2: run.backend"), HasSubstr("no effect")));
}

TEST(Config, ErrorsNameBackendsInDifferentMemories) {
  const auto message = [](const char* device, const char* simulator, const char* renderer) {
    Config c;
    c.run.device = device;
    c.simulator.backend = simulator;
    c.render.backend = renderer;
    return test::message_of([&] { open_learning_device(c); });
  };
  EXPECT_THAT(message("cpu", "cuda", "cpu"), AllOf(HasSubstr("simulator.backend"), HasSubstr("run.device is \"cpu\"")));
  EXPECT_THAT(message("auto", "cuda", "cpu"), AllOf(HasSubstr("simulator.backend"), HasSubstr("render.backend")));
  EXPECT_THAT(message("cuda:0", "cpu", "cuda"), AllOf(HasSubstr("simulator.backend"), HasSubstr("\"cuda:0\"")));
  EXPECT_THAT(message("cuda", "auto", "null"), AllOf(HasSubstr("render.backend"), HasSubstr("\"null\"")));
  // With a renderer or simulator in host memory, auto is the host; no device is queried.
  Config c;
  c.render.backend = "cpu";
  EXPECT_TRUE(open_learning_device(c).is_host());
  c = {};
  c.simulator.backend = "cpu";
  c.render.backend = "cuda";  // draws for host memory
  EXPECT_TRUE(open_learning_device(c).is_host());
  if (!cuda_unavailable_reason().empty()) {
    EXPECT_TRUE(open_learning_device({}).is_host());
    EXPECT_THAT(message("cuda", "auto", "auto"),
                AllOf(HasSubstr("run.device: cuda"), HasSubstr(cuda_unavailable_reason())));
    EXPECT_THAT(message("auto", "cuda", "auto"), HasSubstr("simulator.backend"));
  }
}

TEST(Config, RandomizedCamerasAreReadWrittenAndDrawn) {
  const Config c =
      parse_config("[run]\nseed = 7\n[render.randomization]\nrotation_deg = 3\ndead_probability = 0.1\n", "a.toml");
  EXPECT_EQ(c.render.randomization, (CameraRandomization{.rotation_deg = 3, .dead_probability = 0.1}));
  EXPECT_EQ(parse_config(to_toml(c), "b.toml").render.randomization, c.render.randomization);
  const RendererConfig drawn = renderer_config(c, rig_of(c));
  EXPECT_EQ(drawn.randomization, (CameraRandomization{.seed = 7, .rotation_deg = 3, .dead_probability = 0.1}));
  EXPECT_FALSE(renderer_config({}, paper_rig()).randomization.is_on());
  EXPECT_THAT(error_in("[render.randomization]\nshift_m = 2\n"),
              HasSubstr("a.toml:2: render.randomization.shift_m: expected a number in [0, 1], got 2"));
}

TEST(Config, DifferencesThatChangeTheRunAreNamed) {
  Config a, b;
  b.policy.backbone_width = 256;
  EXPECT_EQ(first_difference(a, b), "policy.backbone_width: 512 became 256");
  b = a;
  b.render.backend = "gl:egl";
  EXPECT_EQ(first_difference(a, b), "render.backend: 'auto' became 'gl:egl'");
  b = a;
  b.render.line_floor_px = 1;
  EXPECT_EQ(first_difference(a, b), "render.line_floor_px: 0.35 became 1.0");
  b = a;
  b.train.schedule_agent_steps = 3;
  b.train.learning_rate = 1;
  b.train.weight_average = 50;
  b.train.reproducible = true;
  b.render.schedule = {{5, 6, 7}};
  b.simulator.num_slots = 40960;
  b.train.minibatch_size = 131072;
  b.train.update_epochs = 1;
  b.render.randomization.shift_m = 0.1;
  EXPECT_EQ(first_difference(a, b), "");
  EXPECT_THAT(
      differences_to_report(a, b),
      ElementsAre("simulator.num_slots: 20480 became 40960", "render.schedule: [] became [[5, 6, 7]]",
                  "render.randomization.shift_m: 0.0 became 0.1", "train.schedule_agent_steps: 50000000000 became 3",
                  "train.minibatch_size: 65536 became 131072", "train.update_epochs: 2 became 1",
                  "train.learning_rate: 0.0005 became 1.0", "train.weight_average: 0.0 became 50.0",
                  "train.reproducible: false became true"));
  b = a;
  b.simulator.wall_seed = 3;
  EXPECT_THAT(first_difference(a, b), HasSubstr("simulator.wall_seed"));
  b = a;
  b.simulator.light_heads = LightHeads::visible;
  EXPECT_EQ(first_difference(a, b), "simulator.light_heads: 'as_mapped' became 'visible'");
}

TEST(Config, RangesOfTownsAreExpandedAndEachMapIsCopied) {
  const auto with = [](const std::vector<std::string>& overrides) {
    return parse_config(
        "[simulator]\nmaps = [\"Town01\", \"procedural:8-9\"]\nnum_slots = 40\nmin_agents = 4\n"
        "max_agents = 4\n",
        "file.toml", overrides);
  };
  const Config plain = with({}), copied = with({"simulator.map_copies=2"});
  EXPECT_THAT(plain.simulator.maps, ElementsAre("Town01", "procedural:8", "procedural:9"));
  EXPECT_EQ(training_maps(plain), plain.simulator.maps);
  EXPECT_THAT(training_maps(copied), ElementsAre("Town01", "procedural:8", "procedural:9", "Town01#1", "procedural:8#1",
                                                 "procedural:9#1", "Town01#2", "procedural:8#2", "procedural:9#2"));
  const std::vector<WorldSpec> worlds = draw_training_worlds(copied), before = draw_training_worlds(plain);
  ASSERT_EQ(worlds.size(), 10u);
  for (size_t i = 0; i < worlds.size(); ++i) {
    EXPECT_EQ(worlds[i].map, static_cast<int>(i % 9));
    EXPECT_EQ(before[i].map, static_cast<int>(i % 3));
  }
  // Copies that no world uses are dropped, maps are not.
  EXPECT_EQ(training_maps(with({"simulator.map_copies=2", "simulator.num_slots=16"})).size(), 4u);
  EXPECT_EQ(training_maps(with({"simulator.map_copies=2", "simulator.num_slots=4"})).size(), 3u);
  EXPECT_EQ(first_difference(plain, copied), "simulator.map_copies: 0 became 2");
  EXPECT_THAT(test::message_of([&] { with({"simulator.maps=[\"procedural:9-8\"]"}); }),
              AllOf(HasSubstr("simulator.maps"), HasSubstr("'procedural:9-8'")));
}

TEST(Config, HarmlessDifferencesAreIgnored) {
  Config a, b;
  b.train.updates = 3;
  b.train.checkpoint_every = 7;
  b.train.keep_checkpoints = 4;
  b.train.milestone_agent_steps = 1000;
  b.train.forward_chunk = 64;
  b.train.halted_slots = HaltedSlots::draw;
  b.train.evaluate_every = 3;
  b.train.evaluate_steps = 5;
  b.run.num_threads = 9;
  b.run.device = "cpu";
  b.simulator.backend = "cpu";
  b.render.backend = "cuda";
  b.render.rig = "the/same/cameras.toml";
  b.evaluate.conditioning[0] = 5;
  EXPECT_EQ(first_difference(a, b), "");
  EXPECT_EQ(first_difference(b, a), "");
  // The vector policy reads no image.
  a.policy.modality = b.policy.modality = Modality::vector;
  b.render.backend = "null";
  b.render.line_floor_px = 1;
  EXPECT_EQ(first_difference(a, b), "");
}

TEST(Config, MessagesShowValuesInOneShortLine) {
  EXPECT_EQ(error_in("[train]\nupdates = {a = 1,  b = 2}\n"),
            "a.toml:2: train.updates: expected an integer in [1, 1099511627776], got a table");
  const std::string message = error_in("[train]\nupdates = \"" + std::string(200, '1') + "\\n\"\n");
  EXPECT_THAT(message, HasSubstr("got '1111"));
  EXPECT_THAT(message, Not(HasSubstr("\n")));
  EXPECT_LT(message.size(), 160u);
}

TEST(Config, ErrorsInEvaluationConditioningNameItsOption) {
  const Config config = with_evaluate_conditioning(Config{}, {"collision=1e0", "center_bias_m=-0.25"});
  EXPECT_EQ(config.evaluate.conditioning[static_cast<size_t>(Conditioning::collision)], 1);
  EXPECT_EQ(config.evaluate.conditioning[static_cast<size_t>(Conditioning::center_bias_m)], -0.25);
  EXPECT_EQ(config.evaluate.conditioning[static_cast<size_t>(Conditioning::off_road)], 3);
  auto message = [](const std::vector<std::string>& values) {
    return test::message_of([&] { with_evaluate_conditioning(Config{}, values); });
  };
  EXPECT_EQ(message({"collison=1"}), "--conditioning: no coefficient 'collison'; did you mean 'collision'?");
  EXPECT_EQ(message({"collision"}), "--conditioning: expected NAME=VALUE, got 'collision'");
  EXPECT_EQ(message({"collision=0x1"}),
            "--conditioning: collision: expected a number in [-1000000, 1000000], got '0x1'");
  EXPECT_EQ(message({"collision=2e6"}),
            "--conditioning: collision: expected a number in [-1000000, 1000000], got '2e6'");
  EXPECT_EQ(message({"collision=1", "collision=2"}), "--conditioning: collision is given twice");
}

TEST(Config, LightCyclesAreReadByTheirNames) {
  EXPECT_EQ(parse_config("", "a.toml").simulator.light_cycles, LightCycles::phases);
  const Config independent = parse_config("[simulator]\nlight_cycles = \"independent\"\n", "a.toml");
  EXPECT_EQ(simulator_config(independent).light_cycles, LightCycles::independent);
  EXPECT_EQ(evaluation_simulator_config(independent, 9).light_cycles, LightCycles::independent);
  EXPECT_EQ(parse_config(to_toml(independent), "b.toml").simulator.light_cycles, LightCycles::independent);
  EXPECT_EQ(first_difference(Config{}, independent), "simulator.light_cycles: 'phases' became 'independent'");
  EXPECT_THAT(error_in("[simulator]\nlight_cycles = \"independant\"\n"),
              AllOf(HasSubstr("a.toml:2: simulator.light_cycles: expected one of phases, independent"),
                    HasSubstr("did you mean 'independent'")));
  EXPECT_EQ(light_cycles_named("independent"), LightCycles::independent);
  EXPECT_EQ(test::message_of([&] { light_cycles_named("alone"); }),
            "light_cycles: expected phases, independent, got 'alone'");
}

TEST(Config, StaggeringAffectsOnlyTrainingAndDynamicsAffectAllWorlds) {
  const Config c =
      parse_config("[simulator.dynamics]\nreset_at_standstill = true\n[train]\nstagger_episodes = true\n", "a.toml");
  const SimulatorConfig training = simulator_config(c), evaluation = evaluation_simulator_config(c, 9);
  EXPECT_TRUE(training.stagger_episodes);
  EXPECT_FALSE(evaluation.stagger_episodes);
  EXPECT_TRUE(training.dynamics.reset_at_standstill);
  EXPECT_EQ(evaluation.dynamics, training.dynamics);
  EXPECT_EQ(simulator_config(Config{}).dynamics, DynamicsRules{});
  Config slow;
  slow.simulator.dynamics.reset_at_standstill = true;
  EXPECT_EQ(first_difference(Config{}, slow), "simulator.dynamics.reset_at_standstill: false became true");
  slow = {};
  slow.train.stagger_episodes = true;
  EXPECT_EQ(first_difference(Config{}, slow), "train.stagger_episodes: false became true");
}

TEST(Config, ImpairedAgentsAffectOnlyTraining) {
  const Config c =
      parse_config("[simulator.others]\nblind = 0.05\nphantom_braking = 0.1\ninattentive = 0.2\n", "a.toml");
  const OtherShares expected{.blind = 0.05f, .phantom_braking = 0.1f, .inattentive = 0.2f};
  EXPECT_EQ(simulator_config(c).others, expected);
  EXPECT_EQ(simulator_config(Config{}).others, OtherShares{});
  EXPECT_EQ(evaluation_simulator_config(c, 9).others, OtherShares{});
  EXPECT_EQ(keys_of_evaluation(c, true), keys_of_evaluation(Config{}, true));
  EXPECT_EQ(first_difference(Config{}, c), "simulator.others.blind: 0.0 became 0.05");
  EXPECT_EQ(parse_config(to_toml(c), "b.toml").simulator.others, expected);
  EXPECT_THAT(error_in("[simulator.others]\nblind = 1.5\n"), HasSubstr("a.toml:2: simulator.others.blind"));
  EXPECT_THAT(
      error_in("[simulator.others]\nblind = 0.5\ninattentive = 0.5\n"),
      HasSubstr("simulator.others: expected shares that sum to less than 1, since the other agents learn, got 1"));
}

TEST(Config, EvaluationFixesConditioningAndLightsAndDisablesEarlyResets) {
  const SimulatorConfig s = evaluation_simulator_config(Config{}, 3000);
  EXPECT_EQ(s.episode_steps, 3000);
  EXPECT_GT(s.reset_inactive_fraction, 1.0f);
  EXPECT_TRUE(s.fixed_lights);
  for (const ConditioningRange& range : s.conditioning) EXPECT_EQ(range.low, range.high);
  EXPECT_EQ(s.conditioning[static_cast<size_t>(Conditioning::delta_goal_m)].low, 2.0f);
  EXPECT_EQ(s.conditioning[static_cast<size_t>(Conditioning::throttle)].low, 1.0f);
}

}  // namespace
}  // namespace pictura
