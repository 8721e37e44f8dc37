"""What is said of an actor that failed, and when one may be given work."""

from ray.exceptions import RayActorError, RaySystemError, RayTaskError

from cluster.runtime.actor_group import Member, full_text, in_one_line


def failed_in_the_actor() -> RayTaskError:
    cause = ValueError("no such file\nand more of it")
    return RayTaskError("collect", "Traceback ...\n\x1b[36mValueError: no such file\x1b[39m", cause)


def test_an_exception_in_an_actor_is_told_by_its_type_and_first_line():
    assert in_one_line(failed_in_the_actor()) == "ValueError: no such file"


def test_the_full_text_keeps_every_line_and_loses_the_colours():
    assert full_text(RaySystemError("\x1b[36mno room\x1b[39m\nat all\n")) == "System error: no room\nat all"
    assert full_text(failed_in_the_actor()).endswith("ValueError: no such file")


def test_a_death_is_told_by_its_last_line_and_other_failures_by_their_first():
    lines = "the actor died\nits node has gone"
    assert in_one_line(RayActorError(error_msg=lines)) == "its node has gone"
    assert in_one_line(RaySystemError(lines)) == "System error: the actor died"


def test_a_member_gets_work_only_after_its_first_answer():
    assert not Member().is_ready
    assert not Member(actor="handle", starting="reference").is_ready
    assert Member(actor="handle").is_ready
