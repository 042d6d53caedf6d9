"""The tires inside MuJoCo: where its fields lie, and the callbacks that act on them."""
