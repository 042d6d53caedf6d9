"""The next experiment: manoeuvres, their rehearsal by simulation, the choice, and its wording."""
