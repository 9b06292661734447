from app.messages import keys
from app.messages.control import SavedSearch, SavedSearches, encode
from app.messages.status import GoalStatus
from app.nodes.console.scene.goal_list import goal_list
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader


def test_goals_are_listed_with_a_tour_in_full_and_the_latest_end_first(stage):
    model = SceneModel()
    reader = SceneReader(model)
    assert goal_list(model).active == []
    saved = SavedSearches(searches=[SavedSearch(saved_id=3, object="my keys")], next_id=4)
    assert reader.feed(keys.SEARCHES_SAVED, encode(saved))
    goals = [GoalStatus(goal_id=k, object="hat") for k in range(5)]
    model.on_status(stage.status_of(goal=goals[0], queue=goals[1:2], history=goals[2:4]))
    listed = goal_list(model)
    assert (listed.active, listed.waiting) == (goals[:1], goals[1:2])
    assert (listed.ended, listed.saved) == ([goals[3], goals[2]], saved)
    model.on_status(stage.status_of(goal=goals[0], tour=[goals[0], goals[4]]))
    assert goal_list(model).active == [goals[0], goals[4]]
