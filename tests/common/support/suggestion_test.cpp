// Suggestion of the known word that is nearest to a misspelt word.
#include "pictura/common/support/suggestion.h"

#include <gtest/gtest.h>

namespace pictura {
namespace {

TEST(Suggestion, IsTheNearestWordWithinADistance) {
  const std::vector<std::string> known{"train.updates", "train.update_epochs", "evaluate", "--config", "Town01",
                                       "Town02"};
  EXPECT_EQ(nearest_word("train.updats", known), "train.updates");
  EXPECT_EQ(nearest_word("trian.updates", known), "train.updates") << "swapped letters";
  EXPECT_EQ(nearest_word("--confg", known), "--config");
  EXPECT_EQ(nearest_word("town01", known), "Town01") << "case counts for nothing";
  EXPECT_EQ(nearest_word("Town1", known), "Town01");
  EXPECT_EQ(nearest_word("fly", known), "");
  EXPECT_EQ(nearest_word("", known), "");
  EXPECT_EQ(nearest_word("xy", {"ab"}), "") << "nothing in common";
  EXPECT_EQ(suggestion("evalute", known), "; did you mean 'evaluate'?");
  EXPECT_EQ(suggestion("simulate", known), "");
}

}  // namespace
}  // namespace pictura
