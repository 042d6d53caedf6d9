"""The person in the chair: segments, joints, landmarks, and the edit that lets them move."""
