"""Texts of docs/any-legs.md, with places for what was measured."""

from __future__ import annotations

from collections.abc import Mapping

# Why robots do not walk, by name, as found by looking at them.
CAUSES: Mapping[str, str] = {}
WHY = """\
The last training met bodies that the ones before had not: humanoids with longer legs under shorter
torsos, whose centre of mass lies ahead of their feet or behind them, hip pitches whose axes slant,
slower and faster drives. Policies had leant by the place of the hips, as the centre of mass was
not among the numbers of a body: real humanoids that carry it further ahead ran after it, and fell.
It is now, instead of the height of the trunk's frame, which makers put anywhere. That training was
ended by the clock: bodies on two legs gained by it, and quadrupeds were still slower than before,
as commands begin small again. What ships is the mean of the weights before and after it, which on
bodies of validation (another seed) keeps most of both.

In all of these trainings a hip yaw whose axis leans far with the thigh counted as turning the other
way, in 8 % of the drawn bodies with slanting hips. In the policy that ships all turn one way:
{walk} of the real bipeds and humanoids walk, where 50 % did. Eight roll-outs leave such a share
uncertain: without the trim of turns it was 68 %, and of eight robots near the rule, 32 roll-outs
each, 88 % stay up without it and 87 % with it.

Robots that fall lie outside the numbers of the training or near their ends, most by weak or slow
ankles or slanting hips; but limx_oli_d04, n1 and icub lie inside and fall all the same. So do
quadrupeds whose centre of mass is high above narrow feet, though each of their numbers lies inside:
the twelve of [learning](learning.md) roll over at {twelve} of the speed that the policy of all
quadrupeds reaches with them (the median). The network normalises its inputs with the zeros of
bodies that lack a joint or a leg, so that the height of the centre of mass and the width between
the feet hardly reach it. Draft drives such quadrupeds by the policy of all quadrupeds.

Gains of the joints once followed the torque of their motors alone, and weak robots stood softly.
Those of hip pitch and knee are for at least 0.6 m g L now on four legs, and 0.4 on six, without a
new training: ANYmal C, which sank and fell, stands and walks slowly. On two legs it made no
difference that roll-outs could show (60 bodies of validation: 94 % instead of 88 % stay up at a
quarter of sqrt(g L), and 58 % instead of 61 % of the real robots walk), so that they keep the gains
of their motors. A training from it (725 iterations of both cores, 22 min) began with slow commands
again, and was behind at speed when it was stopped."""
INTRODUCTION = """\
Draft ships one policy for robots of any legs: two, four or six of them, with three to six driven
joints each. The shipped hexapod, biped and humanoid walk with it; real quadrupeds stay up in {four}
of their roll-outs at half a sqrt(g L), and real bipeds and humanoids in {two} at a quarter. It
observes and moves joints by their place, which is the side, the order from the front and the role
in the leg, and is told torques, speeds, inertias, lengths and the centre of mass of the body, all
without units. For one robot that is an ordinary small network of its own joints, which NumPy runs
in {ms} ms for {joints} joints. It has learnt on bodies that Draft draws, of six kinds in one run
(`draft train any`), and has seen no real robot; but the widths of their draws were chosen anew
after looking at how earlier policies walked these real robots, so that they are no blind test. It
was trained in parts: {first} iterations, of which 3846 with a mistake in the code (a world that
was given another body kept the home pose of the one before) and without a reward for turning, and
{second} more from there (`draft train any --from any`); its weights are the mean of those before
and after these (`python -m scripts.mean_of_policies`). Outside the ranges of these bodies, its
region of validity, it takes the nearest numbers that it knows, says so and tries.

In this page velocities are per sqrt(g L) and rates of turn per sqrt(g / L), with the leg length L.
Roll-outs last {seconds:g} s from noisy starts, with the delays and the noise of the training: the
velocity that the policy observes errs by up to {noise:g} m/s, and that of the policy of all
quadrupeds by up to {family:g} m/s. With {noisy:g} m/s (`--velocity-noise {noisy:g}`), {noisy_four}
of the real quadrupeds walk by the policy of all legs and {noisy_two} of the bipeds and humanoids.
An error is the mean distance of the trunk's velocity from the command, over time and over the
roll-outs that stay up.
Pushes change the velocity by up to {push:g} sqrt(g L) along x and along y, three times."""
TRIM = """\
A policy that meets a robot for the first time misses its commands by a constant: a robot that
carries its mass further ahead drifts ahead. Whatever runs this policy therefore adds up the errors
of the velocity (`draft.learn.policy.trim`). On four legs and more the sum shifts the command, by at
most 0.2 sqrt(g L) and never beyond those of the training, and a turn to 1.6 times those: beyond
the fastest sidestep they follow better (35 % of the drawn quadrupeds, not 12 %), but 42 % and not
65 % stay up. On two it shifts the turn, by at most 0.2 sqrt(g / L), as they turn half as fast again
as asked, and the direction of gravity that the policy observes, by at most 0.15, so that the robot
leans back. Rates and bounds were chosen on generated bodies of another seed; those could not tell
the leans apart, and ten real robots decided, which fall more often with a speed that is shifted.
The policy was trained without it."""
BODIES = """\
{bodies} bodies of the generator, drawn with another seed than those of the training, {each} each at
every command, and kinds that were never trained: knees that point away from each other, five joints
a leg, and eight legs. Cells: share that stays up, and the mean error; sideways and turning: share
that stays up, and the velocity that was reached. Written by `python -m benchmarks.any_legs`."""
ROBOTS = """\
Machines from their makers' descriptions, with their joints, lengths, masses, inertias, torques and
speeds, and the law's torques and speeds where a description has a placeholder; {each} each at every
command. A robot walks if {up} of them stay up and the error is at most {error:g}. The nearest limit
is that of the joints at the fastest command at which half stay up: the 95th percentile of torque or
of speed over its limit, or of the sum of both, which is 1 on the torque-speed line. Outside: the
largest distance of a number of the robot from those of the training, per the width of their range.
Names with `twin` or `vendor` are further files of machines that are listed and count once.
Written by `python -m benchmarks.zero_shot`."""
SEEN = """\
Bodies of the generator, drawn with a third seed, walk at half of their fastest command in plain
MuJoCo; the first row is the cheetah, the bear and the giraffe by their own policies, as a
yardstick. Skating is the share of the load that feet carry while they slide, at more than a quarter
of the speed asked; vibration the share of the power of the joints' velocities above {hertz:g} Hz;
thighs' distance from the ground is per leg length, and the last column the largest motion of a
joint outside the legs. Cells: the median, the least and the most of those that stay up. Written by
`python -m benchmarks.looks`, which draws film strips too (`--pictures DIR`). Feet slide as those of
the yardstick do and thighs stay away from the ground; robots on two legs vibrate more, in ankles
and knees. One quadruped of ten shakes: with the gains of its motors 0.24 of that power was above
{hertz:g} Hz, with those for its weight 0.67."""

DESIGNS = """\
Two designs of the network were compared, three seeds of each from scratch: weights by place, which
ship, and weights into and out of the core that a fixed random map makes of each joint's numbers
(128 random Fourier features; mirror images exact). After 400 s of both cores the mean error of the
velocity in training, over all kinds, was 0.40, 0.42 and 0.45 m/s with weights by place and 0.58,
0.56 and 0.58 m/s with the others, which do three quarters of the iterations in that time; they are
behind at as many iterations too, on every kind but hexapods, and after 600 s (one seed: 0.42 and
0.55 m/s). What trainings of hours would say is open."""
