"""Programs: what a state of a machine does with the robot's skills.

A program is a generator. It yields a command, a wait or a question and receives the reply; it returns the event of
its state. It knows no clock, no physics and no link.
"""
