"""Every guard between a controller and a robot, and how it is taken out: for tests that must then fail."""

from dataclasses import dataclass

HOSTED = "tests/workers/host/test_hosted.py"
CAMPAIGN = "tests/cluster/hardware/test_campaign.py"
JOURNAL = "tests/cluster/hardware/test_journal.py"
GATE = "tests/workers/hardware/test_gate.py"


@dataclass(frozen=True)
class Guard:
    """One guard.

    Attributes:
        what: it keeps from happening.
        file: it stands in.
        old: its text.
        new: the text without it.
        tests: file, or file and what `pytest -k` takes; one of them must fail without the guard.
    """

    what: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]


CONDITIONS = "(_latch_reason, _stop_request, _silent, _late)"
GUARDS = (
    Guard(
        "a command after the latch was set",
        "workers/host/guard.py",
        CONDITIONS,
        "(_stop_request, _silent, _late)",
        (HOSTED, "latch_alone"),
    ),
    Guard(
        "a command after a stop was asked for",
        "workers/host/guard.py",
        CONDITIONS,
        "(_silent, _late)",
        (HOSTED, "stop_reaches_a_motion"),
    ),
    Guard(
        "a command without a sign of life of the driver",
        "workers/host/guard.py",
        CONDITIONS,
        "(_latch_reason, _stop_request, _late)",
        (HOSTED, "parent_that_is_stopped"),
    ),
    Guard(
        "a command after the deadline",
        "workers/host/guard.py",
        CONDITIONS,
        "(_latch_reason, _stop_request, _silent)",
        (HOSTED, "after_the_deadline"),
    ),
    Guard(
        "a command beyond a limit",
        "workers/host/motion.py",
        "found = watch.objection(command)",
        'found = ""',
        ("tests/workers/host/test_controllers.py",),
    ),
    Guard(
        "a plan beyond a limit",
        "workers/host/serve.py",
        "found = first_objection(LimitWatch(self.limits, plan.channels, plan.period), plan.rows)",
        'found = ""',
        (HOSTED, "plan_beyond_the_limits"),
    ),
    Guard(
        "a trial that takes too long",
        "workers/host/serve.py",
        "if not found and plan.seconds > self.limits.duration:",
        "if False:",
        (HOSTED, "plan_beyond_the_limits"),
    ),
    Guard(
        "a trial that the ledger knows moves the robot again",
        "workers/host/serve.py",
        "if trial in started:",
        "if False:",
        (HOSTED, "known_trial"),
    ),
    Guard(
        "a stopped robot begins a trial",
        "workers/host/serve.py",
        "if self.home.latch.is_set:",
        "if False:",
        ("tests/contracts/test_drivers.py", "stopped_robot"),
    ),
    Guard(
        "a motion that the ledger does not know",
        "workers/host/serve.py",
        "        ledger.append(STARTED, {",
        "        dict(started={",
        (HOSTED, "ledger_knows_before_and_after"),
    ),
    Guard(
        "a measurement that is none is believed",
        "workers/host/serve.py",
        "            _require_measurement(measured)\n",
        "",
        (HOSTED, "no_measurement"),
    ),
    Guard(
        "a controller outside the cube is planned",
        "workers/host/protocol.py",
        "    if odd:\n",
        "    if False:\n",
        (HOSTED, "cannot_be_read"),
    ),
    Guard(
        "a robot that its driver could not stop is called at rest",
        "workers/host/motion.py",
        "        _bring_to_rest(machine, error)\n",
        "        machine.stop if machine else None\n",
        (HOSTED, "cannot_be_stopped or cannot_follow"),
    ),
    Guard(
        "a driver that hangs keeps the robot from its stop",
        "workers/host/motion.py",
        "            machine.stop()\n        if not over.wait(_GIVE_UP_SECONDS):\n            give_up(found)",
        "            pass",
        (HOSTED, "wakes_a_driver or never_returns"),
    ),
    Guard(
        "an altered line of the ledger is believed",
        "workers/host/ledger.py",
        "entry is None or entry.hash != entry.expected_hash()",
        "entry is None",
        ("tests/workers/host/test_ledger.py",),
    ),
    Guard(
        "a missing line of the ledger is not noticed",
        "workers/host/ledger.py",
        "if (entry.seq, entry.prev) != (number, prev):",
        "if False:",
        ("tests/workers/host/test_ledger.py",),
    ),
    Guard(
        "a line that was cut off is forgotten",
        "workers/host/ledger.py",
        "known.append(self._close_cut(known, whole, rest))",
        "durable.replace(self.path, whole)",
        ("tests/workers/host/test_ledger.py",),
    ),
    Guard(
        "two campaigns hold one robot",
        "workers/host/home.py",
        "fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)",
        "pass",
        (HOSTED, "one_at_a_time"),
    ),
    Guard(
        "a copied or rolled-back folder moves the robot",
        "workers/hardware/gate.py",
        "        if lost:\n",
        "        if False:\n",
        (GATE,),
    ),
    Guard(
        "a campaign of another home moves the robot",
        "workers/hardware/gate.py",
        "        if known or not granted or any(",
        "        if True or any(",
        (GATE,),
    ),
    Guard(
        "a ledger that was cut off vouches that nothing moved",
        "cluster/hardware/campaign.py",
        " and not motion.started and motion.certain",
        " and not motion.started",
        (CAMPAIGN,),
    ),
    Guard(
        "a trial that may have moved the robot is approved again",
        "cluster/hardware/campaign.py",
        " and not motion.started and motion.certain",
        "",
        (CAMPAIGN,),
    ),
    Guard(
        "a controller outside the cube is approved",
        "cluster/hardware/campaign.py",
        "    reason = objection(trial.x, campaign.dimensions)\n",
        "    reason = None\n",
        (CAMPAIGN,),
    ),
    Guard(
        "a plan that the limits reject is approved",
        "cluster/hardware/campaign.py",
        '    if plan.get("objection"):\n',
        "    if False:\n",
        (CAMPAIGN,),
    ),
    Guard(
        "an approval holds for ever",
        "cluster/hardware/robot/approvals.py",
        'if said.get("until") and now >=',
        "if False and now >=",
        (CAMPAIGN, "lapses"),
    ),
    Guard(
        "an approval holds for other limits",
        "cluster/hardware/robot/approvals.py",
        'if said.get("limits", bounds["limits"]) != bounds["limits"]:',
        "if False:",
        (CAMPAIGN, "lapses"),
    ),
    Guard(
        "an approval outlives a stop",
        "cluster/hardware/robot/approvals.py",
        'if approved.at < bounds["cleared"]:',
        "if False:",
        (CAMPAIGN, "lapses"),
    ),
    Guard(
        "a stopped robot is granted a trial",
        "cluster/hardware/status.py",
        "        if gate.stopped:\n            return Phase.STOPPED\n",
        "",
        (CAMPAIGN, "stopped_or_resting"),
    ),
    Guard(
        "a robot does not rest between trials",
        "cluster/hardware/status.py",
        "if gate.rest_seconds(utc_now()) > 0:",
        "if False:",
        (CAMPAIGN, "stopped_or_resting"),
    ),
    Guard(
        "two trials of one robot are active",
        "cluster/hardware/database.py",
        "CREATE UNIQUE INDEX",
        "CREATE INDEX",
        (JOURNAL,),
    ),
    Guard(
        "a trial goes where it must not",
        "cluster/hardware/journal.py",
        "            if new not in allowed:\n",
        "            if False:\n",
        (JOURNAL,),
    ),
    Guard(
        "a request that is repeated counts twice",
        "cluster/hardware/journal.py",
        "            if known:\n",
        "            if False:\n",
        (JOURNAL,),
    ),
    Guard(
        "an edited journal is believed",
        "cluster/hardware/events.py",
        "        if event.hash != event.expected_hash():\n",
        "        if False:\n",
        (JOURNAL,),
    ),
    Guard(
        "two processes execute one folder",
        "cluster/hardware/lock.py",
        "        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)\n",
        "        pass\n",
        ("tests/cluster/hardware/test_executor.py", "second_executor"),
    ),
    Guard(
        "one wrong number misleads every suggestion",
        "cluster/hardware/record/resolution.py",
        "    if not low <= f <= high:\n",
        "    if False:\n",
        ("tests/cluster/hardware/test_operator.py", "rules_out"),
    ),
    Guard(
        "nobody decides",
        "cluster/hardware/operator.py",
        "    if not who.strip():\n",
        "    if False:\n",
        ("tests/cluster/hardware/test_operator.py", "not_a_person"),
    ),
    Guard(
        "a stop is cleared by nobody",
        "cluster/hardware/robot/stopping.py",
        "    if not who.strip() or not note.strip():\n",
        "    if False:\n",
        ("tests/cluster/hardware/robot/test_stopping.py", "named_person"),
    ),
    Guard(
        "a host is killed though its arm then drops",
        "cluster/hardware/robot/stopping.py",
        ' or host.get("rest", {}).get("kill") not in HARMLESS_TO_KILL',
        "",
        ("tests/cluster/hardware/robot/test_stopping.py", "host_that_hangs"),
    ),
    Guard(
        "what failed comes back",
        "svaedc/bo/strategies.py",
        "            if not self.are_near(x[None], history.failed)[0]:\n",
        "            if True:\n",
        ("tests/svaedc/bo/test_avoidance.py",),
    ),
)
